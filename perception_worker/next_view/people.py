"""People in frames of their own: what the choice of a camera should depend on, and not where in the world they stand.

A person's frame begins on the ground below the middle of their shoulders and hips; x is where they face, y is to their
left, z is up. Lengths are metres.
"""

import numpy as np
from msgspec import Struct

from perception_worker.lifter import Lifter
from perception_worker.next_view.arrays import CAMERAS, Arrays
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.pose_estimate import Evidence
from protocol.skeleton import Joint

_LEFT = [Joint.LEFT_SHOULDER, Joint.LEFT_HIP]
_RIGHT = [Joint.RIGHT_SHOULDER, Joint.RIGHT_HIP]


class PersonFrame(Struct, frozen=True, eq=False, kw_only=True):
    """The frames of people, of any number of dimensions.

    Attributes:
        found: (...) whether their shoulders and hips are known; otherwise they are taken to face along the world's x.
        place: (..., 2) metres.
        yaw: (...) radians, the direction in which they face.
    """

    found: BoolArray
    place: Float64Array
    yaw: Float64Array

    def local(self, points: Float64Array) -> Float64Array:
        """(..., k, 3) points (..., k, 3) of the world in these frames."""
        aside = points[..., :2] - self.place[..., None, :]
        cos, sin = np.cos(self.yaw)[..., None], np.sin(self.yaw)[..., None]
        x, y = cos * aside[..., 0] + sin * aside[..., 1], cos * aside[..., 1] - sin * aside[..., 0]
        return np.stack([x, y, points[..., 2]], axis=-1)


def person_frame(joints: Float64Array, expected: Float64Array) -> PersonFrame:
    """The frames of people.

    Args:
        joints: (..., 18, 3) world frame, metres, NaN where a joint is not known.
        expected: (..., 2) where a person stands whose shoulders and hips are not known, metres.
    """
    left, right = joints[..., _LEFT, :], joints[..., _RIGHT, :]
    across = (left - right).sum(axis=-2)
    found = np.isfinite(across[..., 0])
    place = np.concatenate([left, right], axis=-2)[..., :2].mean(axis=-2)
    return PersonFrame(
        found=found,
        place=np.where(found[..., None], place, expected),
        # A quarter turn clockwise from the person's left, seen from above.
        yaw=np.where(found, np.arctan2(-across[..., 0], across[..., 1]), 0.0),
    )


def lifted_joints(arrays: Arrays, lifter: Lifter) -> Float64Array:
    """(n, 9, 18, 3) the joints as a learned lifter has them from each view; NaN where no person is found."""
    views = [(scene, camera) for scene in range(len(arrays)) for camera in range(CAMERAS)]
    return np.stack([_lifted(arrays, view, lifter) for view in views]).reshape(arrays.points.shape)


def _lifted(arrays: Arrays, view: tuple[int, int], lifter: Lifter) -> Float64Array:
    evidence = Evidence(narrow=arrays.narrow[view].astype(np.float32), wide=arrays.wide[view].astype(np.float32))
    return lifter.lift(arrays.keypoints[view], arrays.height[view], evidence, _camera(arrays, view)).points


def _camera(arrays: Arrays, view: tuple[int, int]) -> Camera:
    (x, y, z), (to_x, to_y, to_z) = arrays.position[view].tolist(), arrays.target[view].tolist()
    fx, fy, cx, cy = arrays.intrinsics[view].tolist()
    intrinsics = Intrinsics(width=round(2 * cx) + 1, height=round(2 * cy) + 1, fx=fx, fy=fy, cx=cx, cy=cy)
    return Camera(CameraPose((x, y, z), (to_x, to_y, to_z)), intrinsics)
