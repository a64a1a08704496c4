"""Every message of version 1 of the wire, and the number that stands for each.

A number is never used again for another message, and a field is only ever added, with a default (docs/protocol.md).
"""

from enum import StrEnum
from typing import Annotated, Any

from msgspec import Meta, Struct

from protocol.camera import Camera
from protocol.frame import Encoding, Frame
from protocol.message import Reply, Request
from protocol.pose_estimate import FilterState, Lifting, PoseEstimate
from protocol.quantities import Interval, Tally
from protocol.region import Region, require_in_picture
from protocol.scene import MOST_BYSTANDERS, Poses, Scene, Split

PROTOCOL_VERSION = 1
OLDEST_PROTOCOL_VERSION = 1


class Role(StrEnum):
    """What a process is."""

    RENDER = "render"
    PERCEPTION = "perception"
    AGENT = "agent"
    ORCHESTRATOR = "orchestrator"


class State(StrEnum):
    """Where a worker stands in its life."""

    STARTING = "starting"
    READY = "ready"
    BUSY = "busy"
    DRAINING = "draining"


AT_WORK = frozenset({State.READY, State.BUSY})
"""The states in which a worker handles requests."""


class Welcome(Reply, frozen=True, eq=False, kw_only=True):
    """The answer to `Hello`: the version that both will speak, and who answers."""

    version: int
    role: Role
    incarnation: str
    capabilities: dict[str, str] = {}
    heartbeat: Interval


class Hello(Request[Welcome], frozen=True, eq=False, kw_only=True):
    """The first message on every connection: the versions that the sender speaks, and who it is."""

    oldest_version: int = OLDEST_PROTOCOL_VERSION
    newest_version: int = PROTOCOL_VERSION
    role: Role
    incarnation: str


class Pong(Reply, frozen=True, eq=False, kw_only=True):
    """How a worker is.

    Attributes:
        incarnation: changes when the process is started again.
        progress: requests answered so far; it moves while work is queued, or the worker hangs.
        queue_depth: requests taken and not yet answered.
        resident_bytes: memory of the process.
        malformed: what came and was no message that this worker could read.
        lacks: the roles of which its handlers need a worker, and of which it knows none at work. It takes requests all
            the same, and they wait with it.
    """

    incarnation: str
    state: State
    progress: Tally
    queue_depth: Tally
    resident_bytes: Tally
    malformed: Tally = 0
    lacks: tuple[Role, ...] = ()


class Ping(Request[Pong], frozen=True, eq=False):
    """Answered by the I/O thread, also while a handler computes."""


class Drained(Reply, frozen=True, eq=False):
    """No request is in hand any more."""


class Drain(Request[Drained], frozen=True, eq=False):
    """Finish what is in hand, take no more."""


class Sampled(Reply, frozen=True, eq=False, kw_only=True):
    """A scene drawn from the seed that was asked for."""

    scene: Scene


class SampleScene(Request[Sampled], frozen=True, eq=False, kw_only=True):
    """Draw a scene; the same seed and split give the same scene on every worker.

    With `bystanders`, the same scene has that many people more in it. With other `poses` than the eight kinds, the same
    person does something else: a worker that does not know the field draws one of the kinds.
    """

    seed: int
    split: Split
    bystanders: Annotated[int, Meta(ge=0, le=MOST_BYSTANDERS)] = 0
    poses: Poses = "kinds"


class Render(Request[Frame], frozen=True, eq=False, kw_only=True):
    """Draw a scene as a camera sees it; with `truth`, the frame has the true joints and which of them are visible.

    The frame may be packed by `encoding`, or not at all, and be the part `region` of the picture, or all of it: a
    worker that does not know these fields answers as ever. A part has the bytes that the whole picture has there.
    """

    scene: Scene
    camera: Camera
    truth: bool = False
    encoding: Encoding = "none"
    region: Region | None = None

    def __post_init__(self) -> None:
        if self.region is not None:
            require_in_picture(self.region, self.camera.intrinsics)


class Perceive(Request[PoseEstimate], frozen=True, eq=False, kw_only=True):
    """Estimate the pose in a frame at hand, as a camera or a recording sends it.

    Attributes:
        liftings: ways of lifting whose readings are to come along, for whoever compares them.
        evidence: whether what a learned lifter is told is to come along, for whoever fits one.
    """

    frame: Frame
    filter: FilterState
    heatmaps: bool = False
    liftings: tuple[Lifting, ...] = ()
    evidence: bool = False


class Observe(Request[PoseEstimate], frozen=True, eq=False, kw_only=True):
    """Have a scene rendered and estimate the pose in it; the frame goes from renderer to perceiver, and no further.

    Attributes:
        liftings, evidence: as in `Perceive`.
    """

    scene: Scene
    camera: Camera
    filter: FilterState
    truth: bool = False
    heatmaps: bool = False
    liftings: tuple[Lifting, ...] = ()
    evidence: bool = False


class WorkerRecord(Struct, frozen=True, kw_only=True):
    """One process as the orchestrator knows it.

    Attributes:
        address: where it serves; empty for an agent, which serves nothing.
        name: what the run calls it, such as `render-0`.
        pid: its number on its own machine; 0 where it did not say.
        key: the public key that it proves to whoever connects; empty where none is asked for.
    """

    role: Role
    address: str
    incarnation: str
    state: State
    name: str = ""
    pid: Tally = 0
    key: str = ""


class Registered(Reply, frozen=True, eq=False, kw_only=True):
    """The worker is in the orchestrator's table.

    Attributes:
        over: whatever it was there for is done; it is to finish what is in hand and end.
    """

    over: bool = False


class Register(Request[Registered], frozen=True, eq=False, kw_only=True):
    """Enter a worker in the orchestrator's table, or its new state."""

    worker: WorkerRecord


class Workers(Reply, frozen=True, eq=False, kw_only=True):
    """The workers of the role that was asked for."""

    workers: tuple[WorkerRecord, ...]


class Lookup(Request[Workers], frozen=True, eq=False, kw_only=True):
    """Who serves a role, and where."""

    role: Role


class Dismissed(Reply, frozen=True, eq=False):
    """The orchestrator waits for this run no more."""


class Dismiss(Request[Dismissed], frozen=True, eq=False, kw_only=True):
    """A run is done, and needs no workers any more.

    Attributes:
        incarnation: the one under which the run's process registered.
    """

    incarnation: str


class Failure(Reply, frozen=True, eq=False, kw_only=True):
    """A request could not be answered.

    Attributes:
        code: stable word for programs: the name of the error, such as `invalid-input` or `draining`.
        message: what happened and what to do, for people.
        retryable: whether the same request may succeed elsewhere or later.
    """

    code: str
    message: str
    retryable: bool = False


MESSAGE_NUMBERS: dict[type[Request[Any]] | type[Reply], int] = {
    Hello: 1,
    Welcome: 2,
    Ping: 3,
    Pong: 4,
    Drain: 5,
    Drained: 6,
    Register: 7,
    Registered: 8,
    Lookup: 9,
    Workers: 10,
    Failure: 11,
    Dismiss: 12,
    Dismissed: 13,
    SampleScene: 16,
    Sampled: 17,
    Render: 18,
    Frame: 19,
    Perceive: 20,
    Observe: 21,
    PoseEstimate: 22,
}
