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
from protocol.region import Region
from protocol.skeleton import JOINT_COUNT, Joint
from render_worker.arrays import IntArray

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


def joint_pixels(joints: Float64Array, camera: Camera) -> tuple[IntArray, BoolArray]:
    """The pixel of each joint (18, 2), column and row, and which of them are in the picture (18,)."""
    x, y, distance = project(joints, camera).T
    in_front = distance > 0
    pixels = np.rint(np.where(in_front, (x, y), -1)).astype(int).T
    size = (camera.intrinsics.width, camera.intrinsics.height)
    return pixels, in_front & np.all((pixels >= 0) & (pixels < size), axis=1)


def with_joints(region: Region, joints: Float64Array, camera: Camera) -> Region:
    """The smallest region that has all of another one, and the pixel of each joint that is in the picture."""
    pixels, in_picture = joint_pixels(joints, camera)
    corners = np.vstack([pixels[in_picture], [(region.left, region.top), (region.right - 1, region.bottom - 1)]])
    (left, top), (right, bottom) = corners.min(axis=0).tolist(), (corners.max(axis=0) + 1).tolist()
    return Region(left, top, right - left, bottom - top)


def visible_joints(
    joints: Float64Array, depth: Float32Array, camera: Camera, region: Region | None = None
) -> BoolArray:
    """Whether the camera sees each joint.

    Args:
        joints: (18, 3) world frame, metres.
        depth: (height, width) noise-free planar depth, metres, 0 where there is nothing.
        region: the part of the picture that the depth covers, with each joint's pixel in it (`with_joints`); by default
            the whole picture.

    Returns:
        (18,).
    """
    pixels, in_picture = joint_pixels(joints, camera)
    corner = (region.left, region.top) if region else (0, 0)
    columns, rows = (pixels[in_picture] - corner).T
    surface = np.zeros(JOINT_COUNT)
    surface[in_picture] = depth[rows, columns]
    distance = project(joints, camera)[:, 2]
    # Nothing at all at a joint's pixel: a thin limb was missed by less than a pixel.
    return in_picture & ((surface == 0) | (distance - surface < flesh_depths()))
