"""Where hair grows: a smooth field over the mean body, positive inside the hair and 0 at the hairline.

Hair must leave the face free: with hair over the face every pose network swaps left and right.
Lengths are fractions of the body's height.
"""

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.skeleton import Joint
from render_worker.arrays import RealArray


def fall_depth(points: RealArray, face: Float64Array, falls: float) -> Float32Array:
    """How far inside long hair the points of its surface lie; it falls behind the ears, to `falls` below the nose.

    Arguments and result are as those of `hair_depth`.
    """
    eye, ear, nose = face[Joint.LEFT_EYE], face[Joint.LEFT_EAR], face[Joint.NOSE]
    stations = [ear[0] - 0.016, ear[0] - 0.006, ear[0] + 0.01, eye[0]]
    heights = [nose[2] - falls, eye[2] + 0.012, eye[2] + 0.03, eye[2] + 0.08]
    return (points[..., 2] - np.interp(points[..., 0], stations, heights)).astype(np.float32)


def hair_depth(points: RealArray, face: Float64Array, length: float = 0.0) -> Float32Array:
    """How far inside the hair points lie.

    Args:
        points: (..., 3) on the mean body.
        face: (18, 3) joints of the mean body.
        length: by how much the hair reaches lower at the back.

    Returns:
        (...,) fractions of the body's height; negative where no hair grows.
    """
    eye, ear, nose = face[Joint.LEFT_EYE], face[Joint.LEFT_EAR], face[Joint.NOSE]
    stations = [ear[0] - 0.02, ear[0] - 0.004, ear[0] + 0.004, ear[0] + 0.010, ear[0] + 0.024, eye[0] + 0.01]
    heights = [
        nose[2] - 0.016 - length,
        nose[2] - 0.010 - length,
        eye[2] - 0.002,
        eye[2] + 0.006,
        eye[2] + 0.026,
        eye[2] + 0.034,
    ]
    above = points[..., 2] - np.interp(points[..., 0], stations, heights)
    # The ears stick out of the hair.
    beside = abs(ear[1]) * 0.97 - np.abs(points[..., 1]) + np.maximum(points[..., 2] - eye[2] - 0.012, 0) * 2
    return np.minimum(above, beside).astype(np.float32)
