"""Stand-ins for an experiment's workers: their answers depend on the request alone, as those of real ones do."""

from collections.abc import Iterable, Iterator

import numpy as np
from msgspec.structs import replace

from protocol.camera import project
from protocol.messages import Observe, Sampled, SampleScene
from protocol.pose_estimate import PoseEstimate
from protocol.scene import Arm, BodyPose, Scene, Sun

ARM = Arm(wrist=(0.0, 0.0, -0.9))
JOINTS = np.column_stack([np.zeros(18), np.zeros(18), np.linspace(0.1, 1.7, 18)])
"""(18, 3) of the person, from their place on the ground."""


def sampled(request: SampleScene) -> Sampled:
    kinds = 8 if request.split == "test" else 6
    scene = Scene(
        identity=0,
        pose=BodyPose(kind=request.seed % kinds, left_arm=ARM, right_arm=ARM),
        appearance=request.seed,
        position=(0.25, -0.125),
        yaw=request.seed % 6 - 3.0,
        sun=Sun(azimuth=0.0, elevation=1.0),
        ground="grass",
        background="brick",
    )
    return Sampled(scene=scene)


class GridWorkers:
    """What `WorkerPools` does of an experiment; every request is noted.

    Args:
        calibrated: whether they tell expected errors and radii.
        hides: degrees from the person's front, from where no person is found by a filter that knows none.
    """

    renderers, perceivers = "render", "perception"

    def __init__(self, *, calibrated: bool = True, hides: tuple[float, ...] = ()) -> None:
        self.calibrated = calibrated
        self.hides = hides
        self.asked: list[Observe | SampleScene] = []

    def answers(self, pool: str, requests: Iterable, activity: str, rate: object = None) -> Iterator:
        for request in requests:
            self.asked.append(request)
            yield sampled(request) if pool == self.renderers else self.estimate(request)

    @property
    def observed(self) -> list[Observe]:
        return [one for one in self.asked if isinstance(one, Observe)]

    def capabilities(self) -> dict[str, str]:
        return {"lifting": "learned"}

    def estimate(self, request: Observe) -> PoseEstimate:
        """Every joint is off by a centimetre for each metre between camera and person, upwards."""
        joints = np.add(JOINTS, (*request.scene.position, 0.0))
        away = np.linalg.norm(np.subtract(request.camera.pose.position[:2], request.scene.position))
        hidden = not request.filter.seen.any() and angle_of(request) in self.hides
        share = np.zeros(18) if hidden else np.full(18, 1.0 / (1.0 + away))
        nan = np.full(18, np.nan)
        state = request.filter if hidden else replace(request.filter, mean=joints, seen=np.ones(18, bool))
        lengths = nan if hidden else np.full(18, 0.01 * away)
        return PoseEstimate(
            keypoints=np.full((18, 2), np.nan) if hidden else project(joints, request.camera)[:, :2],
            points=np.full((18, 3), np.nan) if hidden else np.add(joints, (0.0, 0.0, 0.01 * away)),
            mass=share,
            height=share,
            distance=share,
            quality=share,
            filter=state,
            expected_error=lengths if self.calibrated else None,
            radius=2 * lengths if self.calibrated else None,
            joints=joints if request.truth else None,
        )


def angle_of(request: Observe) -> float:
    """Whole degrees from the person's front to the camera."""
    x, y = np.subtract(request.camera.pose.position[:2], request.scene.position)
    turned = np.degrees(np.arctan2(y, x) - request.scene.yaw)
    return float(np.round((turned + 180.0) % 360.0 - 180.0))
