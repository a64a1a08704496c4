"""A sensor that computes what it sees, for tests: how well a joint is seen depends on angle and distance alone.

The figures follow the map of weighted uncertainty that was measured on renders: about 1.6 in front at 2 to 4 m, 3 to 6
at the sides, 7 from behind, nothing beyond 7 m.
"""

import math
from collections.abc import Callable

import numpy as np

from protocol.camera import Camera
from protocol.client.pending import Pending, Timing
from protocol.pose_estimate import BASE_PROCESS_NOISE, FilterState, PoseEstimate
from protocol.scene import Arm, BodyPose, Scene, Split, Sun
from protocol.skeleton import Joint

BODY = np.array(
    [
        (0.12, 0.00, 1.62), (0.02, 0.00, 1.45), (0.00, -0.18, 1.42), (0.00, -0.24, 1.14), (0.14, -0.24, 0.92),
        (0.00, 0.18, 1.42), (0.00, 0.24, 1.14), (0.14, 0.24, 0.92), (0.00, -0.10, 0.94), (0.02, -0.11, 0.50),
        (0.00, -0.11, 0.08), (0.00, 0.10, 0.94), (0.02, 0.11, 0.50), (0.00, 0.11, 0.08), (0.10, -0.03, 1.66),
        (0.10, 0.03, 1.66), (0.02, -0.08, 1.64), (0.02, 0.08, 1.64),
    ]
)  # fmt: skip
"""(18, 3) joints in the body frame, metres."""

OUTWARD = {
    Joint.NOSE: 0.0, Joint.RIGHT_EYE: -20.0, Joint.LEFT_EYE: 20.0, Joint.RIGHT_EAR: -70.0, Joint.LEFT_EAR: 70.0,
}  # fmt: skip
"""Degrees from the person's front to where a joint of the head faces; the others are seen from all around."""

LEFT_RIGHT = np.array([0, 1, 5, 6, 7, 2, 3, 4, 11, 12, 13, 8, 9, 10, 15, 14, 17, 16])
"""The joint on the other side of the body."""


TIMING = Timing(wall=0.06, compute=0.058)


class AnalyticSensor:
    """Answers at once, or when `deliver` says so; the same question always has the same answer."""

    def __init__(self, deliver: Callable[[Pending[PoseEstimate], PoseEstimate], None] | None = None) -> None:
        self.requests = 0
        self._deliver = deliver or (lambda pending, estimate: pending.succeed(estimate, TIMING))

    def sample(self, seed: int, split: Split) -> Scene:
        rng = np.random.default_rng((seed, len(split)))
        return Scene(
            identity=int(rng.integers(40)) if split == "train" else int(rng.integers(40, 60)),
            pose=BodyPose(kind=0, left_arm=Arm((0.2, 0.0, -0.9)), right_arm=Arm((0.2, 0.0, -0.9))),
            appearance=0,
            position=tuple(rng.uniform(-0.5, 0.5, 2).tolist()),
            yaw=float(rng.uniform(-math.pi, math.pi)),
            sun=Sun(0.0, 1.0),
            ground="plain",
            background="plain",
        )

    def observe(self, scene: Scene, camera: Camera, filter_state: FilterState) -> Pending[PoseEstimate]:
        self.requests += 1
        pending: Pending[PoseEstimate] = Pending()
        self._deliver(pending, observe(scene, camera, filter_state))
        return pending


def observe(scene: Scene, camera: Camera, filter_state: FilterState) -> PoseEstimate:
    """What is seen of the person, and the filter after it."""
    rng = np.random.default_rng(np.array(camera.pose.position).view(np.uint64))
    towards_x, towards_y = np.array(camera.pose.position[:2]) - scene.position
    distance = math.hypot(towards_x, towards_y)
    angle = math.degrees(math.atan2(towards_y, towards_x) - scene.yaw)
    quality = joint_quality(distance, angle) * (rng.random(18) > 0.01)
    points = joints_of(scene) + rng.normal(0.0, 0.02 * distance, (18, 3))
    if abs(wrapped(angle)) > 110 and rng.random() < 0.05 * distance:
        points = points[LEFT_RIGHT]
    points[quality == 0] = np.nan
    return PoseEstimate(
        keypoints=np.where(np.isnan(points), np.nan, 100.0)[:, :2],
        points=points,
        mass=quality,
        height=quality,
        distance=quality,
        quality=quality,
        filter=filtered(filter_state, points, quality),
        timings={"render": 0.02, "infer": 0.03, "transport": 0.001},
    )


def joints_of(scene: Scene) -> np.ndarray:
    """(18, 3) true joints in the world frame."""
    cosine, sine = math.cos(scene.yaw), math.sin(scene.yaw)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return (0.95 + 0.002 * scene.identity) * BODY @ turn.T + (*scene.position, 0.0)


def joint_quality(distance: float, angle: float) -> np.ndarray:
    """(18,) quality of each joint, 0 where it is not found; `angle` in degrees from the person's front."""
    near = np.clip((7.5 - distance) / 2.0, 0.0, 1.0)
    facing = math.cos(math.radians(angle))
    quality = np.full(18, (0.72 + 0.12 * facing) * near**0.5)
    for joint, outward in OUTWARD.items():
        seen = math.cos(math.radians(angle - outward))
        quality[joint] = (0.45 + 0.42 * seen) * near if seen > 0.1 else 0.0
    return np.where(near > 0.05, quality, 0.0)


def filtered(filter_state: FilterState, points: np.ndarray, quality: np.ndarray) -> FilterState:
    """The Kalman filter of the perception workers, in short."""
    found = ~np.isnan(points[:, 0])
    noise = np.where(found, BASE_PROCESS_NOISE, filter_state.process_noise + 0.001)
    prior = filter_state.variance + np.where(filter_state.seen, noise, 0.0)[:, None]
    measured = np.maximum(1.0 - quality, 1e-4)[:, None]
    gain = np.where(found[:, None], prior / (prior + measured), 0.0)
    return FilterState(
        mean=filter_state.mean + gain * (np.nan_to_num(points) - filter_state.mean),
        variance=(1.0 - gain) * prior,
        process_noise=noise,
        seen=filter_state.seen | found,
    )


def wrapped(degrees: float) -> float:
    """The same angle in [-180, 180)."""
    return (degrees + 180.0) % 360.0 - 180.0
