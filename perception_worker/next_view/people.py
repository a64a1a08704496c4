"""People in frames of their own: what the choice of a camera should depend on, and not where in the world they stand.

A person's frame begins on the ground below the middle of their shoulders and hips; x is where they face, y is to their
left, z is up. Lengths are metres.
"""

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from perception_worker.lifter import Lifter
from perception_worker.lifter.lifter import LEAST_FOUND
from perception_worker.lifter.tokens import Seen
from perception_worker.next_view.arrays import Arrays
from protocol.arrays import BoolArray, Float64Array
from protocol.joint_arrays import EVIDENCE_SIZE
from protocol.skeleton import JOINT_COUNT, Joint

_AT_ONCE = 512

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
    keypoints = arrays.keypoints.reshape(-1, JOINT_COUNT, 2)
    found = np.flatnonzero(np.isfinite(keypoints[:, :, 0]).sum(axis=1) >= LEAST_FOUND)
    transforms = arrays.transforms().reshape(-1, 4, 4)
    joints = np.full((len(keypoints), JOINT_COUNT, 3), np.nan)
    for views in np.split(found, range(_AT_ONCE, len(found), _AT_ONCE)):
        if len(views):
            points = lifter.estimate(_seen(arrays, views, transforms[views])).points
            joints[views] = (points - transforms[views, None, :3, 3]) @ transforms[views, :3, :3]
    return joints.reshape(arrays.points.shape)


def _seen(arrays: Arrays, views: NDArray[np.intp], transforms: Float64Array) -> Seen:
    """The evidence of some views, by their numbers among all."""
    focal, centre = np.split(arrays.intrinsics.reshape(-1, 1, 4)[views], 2, axis=2)
    return Seen(
        rays=(arrays.keypoints.reshape(-1, JOINT_COUNT, 2)[views] - centre) / focal,
        height=arrays.height.reshape(-1, JOINT_COUNT)[views],
        narrow=arrays.narrow.reshape(-1, JOINT_COUNT, EVIDENCE_SIZE)[views].astype(np.float32),
        wide=arrays.wide.reshape(-1, JOINT_COUNT, EVIDENCE_SIZE)[views].astype(np.float32),
        up=transforms[:, 1:3, 2],
        focal=focal[:, 0, 0],
    )
