"""The suite's requests to a worker, by role: small ones that can be told apart, and large ones.

Every request has a tag from 0 up that comes back in its reply, so that a reply to another request is detected even if
it has the right id.
"""

from typing import Any, Protocol, get_args

import numpy as np
from msgspec.structs import replace

from protocol.camera import Camera, CameraPose, DepthNoise, Intrinsics
from protocol.catalogue import Message
from protocol.frame import Frame
from protocol.message import Request
from protocol.messages import Observe, Perceive, Render, Role, SampleScene
from protocol.pose_estimate import FilterState, Lifting, PoseEstimate
from protocol.region import Region
from protocol.scene import Arm, BodyPose, Figure, Scene, Sun, Trunk

_POSE = CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0))
_LARGE = 640, 480
_SMALL = 32, 24
_ALL = Region(0, 0, *_SMALL)
_PART = Region(9, 5, 13, 7)

SCENE = Scene(
    identity=3,
    pose=BodyPose(kind=0, left_arm=Arm((0.0, 0.2, -0.9)), right_arm=Arm((0.0, -0.2, -0.9))),
    appearance=7,
    position=(0.0, 0.0),
    yaw=0.0,
    sun=Sun(0.1, 0.8),
    ground="grass",
    background="sky-clear",
)
"""For workers that draw no scenes. A renderer behind them may not know its ground; then the reply is a Failure."""


class Work(Protocol):
    """The requests to workers of a role."""

    def small(self, tag: int = 0) -> Request[Any]:
        """The smallest request; tags 0 to 999 can be told apart."""
        ...

    def large(self, tag: int = 0) -> Request[Any]:
        """A picture of the usual size, which takes milliseconds at least, so that other messages arrive meanwhile."""
        ...

    def answers(self, reply: Message, request: Request[Any]) -> bool:
        """Whether a reply belongs to a request."""
        ...

    def others(self) -> tuple[Request[Any], ...]:
        """One request of each further type that the role answers."""
        ...

    def full(self) -> tuple[Request[Any], ...]:
        """One request of each type of the role with every optional field set, so that it has all of its numbers."""
        ...

    def parts(self) -> tuple[Render, ...]:
        """Requests of parts of pictures, if the role draws any."""
        ...


class RenderWork:
    """Pictures of a scene that the worker itself has sampled; the tag is in the picture's width."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def small(self, tag: int = 0) -> Render:
        """A picture of a few pixels."""
        return self._render(_SMALL[0] + tag, _SMALL[1])

    def large(self, tag: int = 0) -> Render:
        """A picture of 640×480 and a little."""
        return self._render(_LARGE[0] + tag, _LARGE[1])

    def answers(self, reply: Message, request: Request[Any]) -> bool:
        """A frame has the camera of its request."""
        return isinstance(reply, Frame) and isinstance(request, Render) and reply.camera == request.camera

    def others(self) -> tuple[Request[Any], ...]:
        """Scenes, and a packed picture."""
        # A worker that does not know the field `encoding` sends the frame unpacked.
        return SampleScene(seed=1, split="train"), replace(self.small(), encoding="lossless")

    def full(self) -> tuple[Request[Any], ...]:
        """A scene, and a part of a picture of two people with its truth."""
        scene = _crowded(self._scene)
        return (
            SampleScene(seed=1, split="train", bystanders=1),
            replace(self._measured("d435i"), scene=scene, truth=True, region=_PART),
        )

    def parts(self) -> tuple[Render, ...]:
        """Regions inside, at each border, of one pixel, and the whole picture; with exact and with measured depth."""
        return tuple(
            replace(whole, region=region)
            for whole in map(self._measured, get_args(DepthNoise))
            for region in (_PART, Region(0, 0, 11, 24), Region(20, 23, 12, 1), Region(31, 0, 1, 1), _ALL)
        )

    def _measured(self, noise: DepthNoise) -> Render:
        whole = self.small()
        return replace(whole, camera=replace(whole.camera, depth_noise=noise))

    def _render(self, width: int, height: int) -> Render:
        return Render(scene=self._scene, camera=_camera(width, height))


class PerceptionWork:
    """Frames of noise; the tag is in their true joints, which a perception worker passes on."""

    def small(self, tag: int = 0) -> Perceive:
        """A frame of a few pixels."""
        return Perceive(frame=_noise(*_SMALL, tag), filter=FilterState.initial())

    def large(self, tag: int = 0) -> Perceive:
        """A frame of 640×480."""
        return Perceive(frame=_noise(*_LARGE, tag), filter=FilterState.initial())

    def answers(self, reply: Message, request: Request[Any]) -> bool:
        """An estimate has the true joints of its frame."""
        if not isinstance(reply, PoseEstimate) or not isinstance(request, Perceive):
            return False
        return reply.joints is not None and np.array_equal(reply.joints, _joints_of(request))

    def others(self) -> tuple[Request[Any], ...]:
        """A frame that is rendered for it."""
        return (Observe(scene=SCENE, camera=_camera(*_SMALL), filter=FilterState.initial()),)

    def full(self) -> tuple[Request[Any], ...]:
        """A given frame and one that is rendered, with all optional parts of the reply."""
        along: dict[str, Any] = {"liftings": get_args(Lifting), "heatmaps": True, "evidence": True}
        part = replace(_noise(*_SMALL, 0).part(_PART), timings={"render": 0.1})
        # Without bystanders, which only cost the renderer time.
        scene, camera, state = _bent(SCENE), _camera(*_SMALL), FilterState.initial(rule="variance")
        return (
            Perceive(frame=part, filter=state, **along),
            Observe(scene=scene, camera=camera, filter=state, truth=True, **along),
        )

    def parts(self) -> tuple[Render, ...]:
        """None."""
        return ()


def frame_to_perceive(tag: int = 0) -> Perceive:
    """A request with arrays, which every worker must be able to refuse."""
    return PerceptionWork().small(tag)


ROLES = (Role.RENDER, Role.PERCEPTION)
"""The roles whose requests the suite knows."""


def _crowded(scene: Scene) -> Scene:
    """The scene with its person bent and a bystander, so that every field of a scene is sent."""
    bystander = Figure(identity=5, pose=SCENE.pose, appearance=8, position=(1.0, 1.0), yaw=0.5)
    return replace(_bent(scene), bystanders=(bystander,))


def _bent(scene: Scene) -> Scene:
    """The scene with its person bent, since an upright trunk is not sent."""
    return replace(scene, pose=replace(scene.pose, trunk=Trunk(bend=0.1)))


def _camera(width: int, height: int) -> Camera:
    return Camera(_POSE, Intrinsics.from_horizontal_fov(width, height, 70.0))


def _noise(width: int, height: int, tag: int) -> Frame:
    random = np.random.default_rng(tag)
    return Frame(
        rgb=random.integers(0, 256, (height, width, 3), np.uint8),
        depth=np.full((height, width), 3.0, np.float32),
        camera=_camera(width, height),
        joints=np.full((18, 3), float(tag)),
        visible=np.ones(18, bool),
    )


def _joints_of(request: Perceive) -> Any:
    return request.frame.joints
