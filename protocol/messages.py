"""Every message of version 1 of the wire protocol, and the number of each.

A number is never reused for another message, and a field is only ever added, with a default (docs/protocol.md).
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
    """The role of a process."""

    RENDER = "render"
    PERCEPTION = "perception"
    AGENT = "agent"
    ORCHESTRATOR = "orchestrator"


class State(StrEnum):
    """The state of a worker."""

    STARTING = "starting"
    READY = "ready"
    BUSY = "busy"
    DRAINING = "draining"


AT_WORK = frozenset({State.READY, State.BUSY})
"""The states in which a worker handles requests."""


class Welcome(Reply, frozen=True, eq=False, kw_only=True):
    """The reply to `Hello`: the version that both sides will use, and the worker's identity."""

    version: int
    role: Role
    incarnation: str
    capabilities: dict[str, str] = {}
    heartbeat: Interval


class Hello(Request[Welcome], frozen=True, eq=False, kw_only=True):
    """The first message on every connection: the versions that the sender speaks, and its identity."""

    oldest_version: int = OLDEST_PROTOCOL_VERSION
    newest_version: int = PROTOCOL_VERSION
    role: Role
    incarnation: str


class Pong(Reply, frozen=True, eq=False, kw_only=True):
    """The state of a worker.

    Attributes:
        incarnation: changes when the process is restarted.
        progress: number of requests answered so far. While requests are queued it grows, unless the worker hangs.
        queue_depth: number of requests taken and not yet answered.
        resident_bytes: memory of the process.
        malformed: number of messages that this worker could not read.
        lacks: the roles of which its handlers need a worker, and of which it knows none at work. It still takes
            requests, which then wait.
    """

    incarnation: str
    state: State
    progress: Tally
    queue_depth: Tally
    resident_bytes: Tally
    malformed: Tally = 0
    lacks: tuple[Role, ...] = ()


class Ping(Request[Pong], frozen=True, eq=False):
    """Asks for the worker's state. The I/O thread answers, also while a handler computes."""


class Drained(Reply, frozen=True, eq=False):
    """The reply to `Drain`: every request in hand has been answered."""


class Drain(Request[Drained], frozen=True, eq=False):
    """Asks the worker to answer the requests in hand, take no new ones, and end."""


class Sampled(Reply, frozen=True, eq=False, kw_only=True):
    """The scene of the requested seed."""

    scene: Scene


class SampleScene(Request[Sampled], frozen=True, eq=False, kw_only=True):
    """Asks for a random scene; the same seed and split give the same scene on every worker.

    Attributes:
        bystanders: number of people to add to the same scene.
        poses: what the same person's pose is drawn from. A worker that does not know the field draws one of the eight
            kinds.
    """

    seed: int
    split: Split
    bystanders: Annotated[int, Meta(ge=0, le=MOST_BYSTANDERS)] = 0
    poses: Poses = "kinds"


class Render(Request[Frame], frozen=True, eq=False, kw_only=True):
    """Asks for a picture of a scene.

    Attributes:
        truth: whether the frame carries the true joints, and which of them are visible.
        encoding: how the frame may be packed.
        region: the part of the picture to send, with the same bytes as in the whole picture; None for all of it.

    A worker that does not know `encoding` or `region` sends the whole picture, not packed.
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
    """Asks for the pose in a given frame, as from a camera or a recording.

    Attributes:
        heatmaps: whether the reply carries the network's heatmaps.
        liftings: ways of lifting to compare; the reply carries the readings of each.
        evidence: whether the reply carries the input of a learned lifter, to fit one.
    """

    frame: Frame
    filter: FilterState
    heatmaps: bool = False
    liftings: tuple[Lifting, ...] = ()
    evidence: bool = False


class Observe(Request[PoseEstimate], frozen=True, eq=False, kw_only=True):
    """Asks for the pose in a picture of a scene, which the perception worker requests from a render worker.

    Attributes:
        truth: as in `Render`.
        heatmaps, liftings, evidence: as in `Perceive`.
    """

    scene: Scene
    camera: Camera
    filter: FilterState
    truth: bool = False
    heatmaps: bool = False
    liftings: tuple[Lifting, ...] = ()
    evidence: bool = False


class WorkerRecord(Struct, frozen=True, kw_only=True):
    """One process in the orchestrator's table.

    Attributes:
        address: where it serves; empty for an agent, which serves nothing.
        name: what the run calls it, such as `render-0`.
        pid: on its own machine; 0 if it is not known.
        key: the public key that it proves to its clients; empty without keys.
    """

    role: Role
    address: str
    incarnation: str
    state: State
    name: str = ""
    pid: Tally = 0
    key: str = ""


class Registered(Reply, frozen=True, eq=False, kw_only=True):
    """The reply to `Register`: the process is in the orchestrator's table.

    Attributes:
        over: whether the run is over; then the process should answer the requests in hand and end.
    """

    over: bool = False


class Register(Request[Registered], frozen=True, eq=False, kw_only=True):
    """Enters a process, or its new state, in the orchestrator's table."""

    worker: WorkerRecord


class Workers(Reply, frozen=True, eq=False, kw_only=True):
    """The reply to `Lookup`: the workers of the requested role."""

    workers: tuple[WorkerRecord, ...]


class Lookup(Request[Workers], frozen=True, eq=False, kw_only=True):
    """Asks for the workers of a role."""

    role: Role


class Dismissed(Reply, frozen=True, eq=False):
    """The reply to `Dismiss`: the orchestrator does not wait for this run any more."""


class Dismiss(Request[Dismissed], frozen=True, eq=False, kw_only=True):
    """Says that a run is done and needs no workers any more.

    Attributes:
        incarnation: with which the run's process registered.
    """

    incarnation: str


class Failure(Reply, frozen=True, eq=False, kw_only=True):
    """The reply to any request that could not be answered.

    Attributes:
        code: a stable name of the error, for programs, such as `invalid-input` or `draining`.
        message: what happened and what to do, for people.
        retryable: whether the same request may succeed at another worker or later.
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
