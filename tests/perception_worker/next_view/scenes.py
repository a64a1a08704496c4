"""Arrays of cameras around people whose uncertainty follows a rule."""

from collections.abc import Callable

import cv2
import numpy as np

from perception_worker.next_view.arrays import CAMERAS, Arrays
from protocol.arrays import Float64Array
from protocol.skeleton import JOINT_COUNT, Joint

BODY = np.zeros((JOINT_COUNT, 3))
"""A person at the origin who faces along x."""
BODY[:, 2] = 1.2
BODY[[Joint.LEFT_SHOULDER, Joint.LEFT_HIP], 1] = 0.2
BODY[[Joint.RIGHT_SHOULDER, Joint.RIGHT_HIP], 1] = -0.2
BODY[Joint.NOSE, 0] = 0.1


def turned(points: Float64Array, yaw: float) -> Float64Array:
    """Points (..., 3) turned around the vertical."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]).T


def around_front(distance: Float64Array, angle: Float64Array, height: Float64Array) -> Float64Array:
    """An uncertainty of 0 in front of a person and of 10 behind."""
    return 5.0 * (1.0 - np.cos(angle)) + 0.0 * (distance + height)


def arrays_of(
    count: int,
    rule: Callable[[Float64Array, Float64Array, Float64Array], Float64Array] = around_front,
    *,
    test_share: float = 0.25,
    seed: int = 0,
) -> Arrays:
    """Scenes of people at the origin, seen from 4 m away and all sides.

    Args:
        rule: weighted uncertainty of a camera, by its distance along the ground, its angle from the person's front in
            radians, and its height.
    """
    random = np.random.default_rng(seed)
    yaw, bearing = random.uniform(-np.pi, np.pi, (2, count))
    ahead = np.stack([np.cos(bearing), np.sin(bearing), np.zeros(count)], axis=1)
    right = np.stack([-np.sin(bearing), np.cos(bearing), np.zeros(count)], axis=1)
    cells = [(column, row) for row in (1, 0, -1) for column in (-1, 0, 1)]
    position = np.stack(
        [4.0 * ahead + column * right + np.array([0.0, 0.0, 2.0 + row]) for column, row in cells], axis=1
    )
    distance = np.hypot(position[..., 0], position[..., 1])
    angle = np.arctan2(position[..., 1], position[..., 0]) - yaw[:, None]
    quality = 1.0 - np.repeat(rule(distance, angle, position[..., 2])[..., None], JOINT_COUNT, axis=2) / 10.0
    joints = np.stack([turned(BODY, one) for one in yaw])
    _, black = cv2.imencode(".jpg", np.zeros((24, 32, 3), np.uint8))
    return Arrays(
        is_train=np.arange(count) >= test_share * count,
        scene=np.arange(count),
        yaw=yaw,
        person=np.zeros((count, 2)),
        position=position,
        target=np.tile([0.0, 0.0, 1.2], (count, CAMERAS, 1)),
        intrinsics=np.tile([450.0, 450.0, 319.5, 239.5], (count, CAMERAS, 1)),
        keypoints=np.full((count, CAMERAS, JOINT_COUNT, 2), np.nan),
        points=np.repeat(joints[:, None], CAMERAS, axis=1),
        height=np.ones((count, CAMERAS, JOINT_COUNT)),
        quality=quality,
        narrow=np.full((count, CAMERAS, JOINT_COUNT, 7), np.nan),
        wide=np.full((count, CAMERAS, JOINT_COUNT, 7), np.nan),
        joints=joints,
        pictures=(black.tobytes(),) * count,
    )
