"""Which joints a camera sees, decided by the depth image.

A joint is visible when it is in front of the camera, its pixel is in the image, and the surface at that pixel is no
nearer than the flesh that may lie over the joint. Joints of the trunk and limbs are inside the body, and their limits
are the thickest flesh measured over them in unoccluded views of all identities; those of the face lie on it, so eyes
are hidden from behind by the head, 15 cm thick. A joint behind another limb, or on the trunk's far side, has more
than its limit before it.
"""

import numpy as np

from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.camera import Camera, project
from protocol.skeleton import JOINT_COUNT, Joint

_FLESH: dict[Joint, float] = {
    Joint.NOSE: 0.03,
    Joint.LEFT_EYE: 0.035,
    Joint.RIGHT_EYE: 0.035,
    Joint.LEFT_EAR: 0.06,
    Joint.RIGHT_EAR: 0.06,
    Joint.NECK: 0.16,
    Joint.LEFT_SHOULDER: 0.14,
    Joint.RIGHT_SHOULDER: 0.14,
    Joint.LEFT_ELBOW: 0.085,
    Joint.RIGHT_ELBOW: 0.085,
    Joint.LEFT_WRIST: 0.065,
    Joint.RIGHT_WRIST: 0.065,
    Joint.LEFT_HIP: 0.155,
    Joint.RIGHT_HIP: 0.155,
    Joint.LEFT_KNEE: 0.115,
    Joint.RIGHT_KNEE: 0.115,
    Joint.LEFT_ANKLE: 0.075,
    Joint.RIGHT_ANKLE: 0.075,
}
"""Metres of flesh and cloth that may lie over a joint, along the view."""


def flesh_depths() -> Float64Array:
    """(18,) metres that may lie between a joint and the surface above it."""
    return np.array([_FLESH[joint] for joint in Joint])


def visible_joints(joints: Float64Array, depth: Float32Array, camera: Camera) -> BoolArray:
    """Whether the camera sees each joint.

    Args:
        joints: (18, 3) world frame, metres.
        depth: (height, width) noise-free planar depth, metres, 0 where there is nothing.

    Returns:
        (18,).
    """
    x, y, distance = project(joints, camera).T
    in_front = distance > 0
    columns = np.rint(np.where(in_front, x, -1)).astype(int)
    rows = np.rint(np.where(in_front, y, -1)).astype(int)
    height, width = depth.shape
    in_image = in_front & (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    surface = np.zeros(JOINT_COUNT)
    surface[in_image] = depth[rows[in_image], columns[in_image]]
    # Nothing at all at a joint's pixel: a thin limb was missed by less than a pixel.
    return in_image & ((surface == 0) | (distance - surface < flesh_depths()))
