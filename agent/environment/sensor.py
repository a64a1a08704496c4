"""The drone's sensor: scenes come from the render workers, pose estimates from the perception workers."""

from typing import Any, Protocol

from protocol.camera import Camera
from protocol.client.pending import Pending
from protocol.client.pool import Pool
from protocol.messages import Observe, SampleScene
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.scene import Scene, Split


class Sensor(Protocol):
    """What an environment needs from outside: scenes, and estimates of a person's pose."""

    def sample(self, seed: int, split: Split) -> Scene:
        """The scene of a seed; always the same one."""
        ...

    def observe(self, scene: Scene, camera: Camera, filter_state: FilterState) -> Pending[PoseEstimate]:
        """Request a picture and the pose estimate in it; many requests may be under way at once."""
        ...


class RemoteSensor:
    """A sensor made of worker processes. The owner of the pools closes them."""

    def __init__(self, render: Pool, perception: Pool) -> None:
        self._render = render
        self._perception = perception

    def sample(self, seed: int, split: Split) -> Scene:
        """Ask a render worker for the scene of a seed."""
        return self._render.call(SampleScene(seed=seed, split=split)).scene

    def observe(self, scene: Scene, camera: Camera, filter_state: FilterState) -> Pending[PoseEstimate]:
        """Ask a perception worker for an estimate; it has the picture rendered."""
        return self._perception.submit(Observe(scene=scene, camera=camera, filter=filter_state))

    def __deepcopy__(self, memo: dict[int, Any]) -> "RemoteSensor":
        # Gymnasium copies an environment's arguments when it makes another like it; connections can only be shared.
        return self
