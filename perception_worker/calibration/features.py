"""The features that tell how far a joint may be from where it was placed, all known once a frame is lifted.

The strongest is how much farther than the rest of the body a joint lies: a wrist with the wall's depth. Then come the
height of its peak, the lengths of the bones about it, and on which side of the body it is against which way the body
seems to face, which tells left and right exchanged.
"""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from perception_worker.median import median
from protocol.arrays import AnyArray, Float32Array, Float64Array
from protocol.camera import Vector3
from protocol.skeleton import JOINT_COUNT, Joint

ABSENT = -100.0
"""Stands for an unknown value, such as the length of a bone with an end that was not located."""

FEATURES = (
    "kind",
    "mass",
    "height",
    "distance",
    "spread",
    "range",
    "found",
    "depth_offset",
    "centre_offset",
    "rise",
    "bone",
    "bone_depth",
    "bone_height",
    "pair",
    "pair_depth",
    "pair_height",
    "side",
    "shoulders",
    "hips",
)
"""The columns, in this order; metres, but for `kind`, `found` (numbers), quality's components and `..._height`.

`kind`: which joint, left and right alike. `range`: from the camera. `found`: how many joints were detected.
`depth_offset`, `centre_offset`, `rise`: how much farther than the body's middle, how far from it, how high above it.
`bone`, `bone_depth`, `bone_height`: length to the joint that it hangs on, how much farther it is than that, and that
one's height of peak. `pair...`: the same with its mirror joint. `side`: how far on its own side of the middle, as seen
from the camera. `shoulders`, `hips`: how far the left one is to the right of the right one, positive in a body that
faces the camera.
"""

_KIND_NAMES = tuple(dict.fromkeys(joint.name.rpartition("_")[2] for joint in Joint))
KIND = np.array([_KIND_NAMES.index(joint.name.rpartition("_")[2]) for joint in Joint])
"""(18,) the number of each joint's kind."""

_PARENTS = {
    Joint.NOSE: Joint.NECK,
    Joint.NECK: Joint.NOSE,
    Joint.RIGHT_SHOULDER: Joint.NECK,
    Joint.RIGHT_ELBOW: Joint.RIGHT_SHOULDER,
    Joint.RIGHT_WRIST: Joint.RIGHT_ELBOW,
    Joint.LEFT_SHOULDER: Joint.NECK,
    Joint.LEFT_ELBOW: Joint.LEFT_SHOULDER,
    Joint.LEFT_WRIST: Joint.LEFT_ELBOW,
    Joint.RIGHT_HIP: Joint.NECK,
    Joint.RIGHT_KNEE: Joint.RIGHT_HIP,
    Joint.RIGHT_ANKLE: Joint.RIGHT_KNEE,
    Joint.LEFT_HIP: Joint.NECK,
    Joint.LEFT_KNEE: Joint.LEFT_HIP,
    Joint.LEFT_ANKLE: Joint.LEFT_KNEE,
    Joint.RIGHT_EYE: Joint.NOSE,
    Joint.LEFT_EYE: Joint.NOSE,
    Joint.RIGHT_EAR: Joint.RIGHT_EYE,
    Joint.LEFT_EAR: Joint.LEFT_EYE,
}
_HANGS_ON = np.array([_PARENTS[joint] for joint in Joint])

_RIGHT = np.array([joint for joint in Joint if joint.name.startswith("RIGHT")])
_LEFT = np.array([joint for joint in Joint if joint.name.startswith("LEFT")])
_MIRROR = np.arange(JOINT_COUNT)
_MIRROR[_RIGHT], _MIRROR[_LEFT] = _LEFT, _RIGHT

# A person who faces the camera has the left arm on the picture's right.
_SIDE = np.ones(JOINT_COUNT)
_SIDE[_RIGHT] = -1.0

_Columns: TypeAlias = Mapping[str, AnyArray | float]
"""Values (18,), or one for all joints, by the names of `FEATURES`."""


def joint_features(
    points: Float64Array,
    *,
    mass: Float64Array,
    height: Float64Array,
    distance: Float64Array,
    spread: Float64Array,
    camera: Vector3,
) -> Float32Array:
    """The features of one frame's joints; those of a joint that was not located have no meaning.

    Args:
        points: (18, 3) world frame, metres, NaN where a joint was not located; one at least was.
        mass, height, distance: (18,) the components of quality.
        spread: (18,) metres between the depths around each joint.
        camera: where the camera is, world frame, metres.

    Returns:
        (18, 19) as `FEATURES` names them, `ABSENT` for unknown values.
    """
    ranges = np.sqrt(((points - camera) ** 2).sum(axis=1))
    columns: _Columns = {
        "kind": KIND,
        "mass": mass,
        "height": height,
        "distance": distance,
        "spread": spread,
        "range": ranges,
        "found": float(np.count_nonzero(height)),
        **_against_body(points, ranges, camera),
        **_against_joint("bone", _HANGS_ON, points, ranges, height),
        **_against_joint("pair", _MIRROR, points, ranges, height),
    }
    features = np.empty((JOINT_COUNT, len(FEATURES)))
    for place, name in enumerate(FEATURES):
        features[:, place] = columns[name]
    features[np.isnan(features)] = ABSENT
    return features.astype(np.float32)


def _against_body(points: Float64Array, ranges: Float64Array, camera: Vector3) -> _Columns:
    located = np.isfinite(points[:, 0])
    # Along axes that turn with the view: a median for each axis depends on how the axes lie.
    from_camera = (points - camera) @ _axes_of_view(points[located].mean(axis=0) - camera)
    from_middle = from_camera - median(from_camera[located])
    across = from_middle[:, 0]
    return {
        "depth_offset": ranges - median(ranges[located]),
        "centre_offset": np.sqrt((from_middle**2).sum(axis=1)),
        "rise": from_middle[:, 2],
        "side": across * _SIDE,
        "shoulders": across[Joint.LEFT_SHOULDER] - across[Joint.RIGHT_SHOULDER],
        "hips": across[Joint.LEFT_HIP] - across[Joint.RIGHT_HIP],
    }


def _against_joint(
    name: str, other: NDArray[np.int64], points: Float64Array, ranges: Float64Array, height: Float64Array
) -> _Columns:
    """Each joint against another one (18,): the distance, the difference in depth, and the other's height of peak."""
    return {
        name: np.sqrt(((points - points[other]) ** 2).sum(axis=1)),
        f"{name}_depth": ranges - ranges[other],
        f"{name}_height": height[other],
    }


def _axes_of_view(towards: Float64Array) -> Float64Array:
    """Columns: level to the right of the view `towards`, level ahead, and up (straight down: up alone)."""
    x, y = towards[:2] / max(float(np.hypot(towards[0], towards[1])), 1e-9)
    return np.array([[y, x, 0.0], [-x, y, 0.0], [0.0, 0.0, 1.0]])
