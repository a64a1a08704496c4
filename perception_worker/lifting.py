"""From keypoints in the picture to points in the world (seed, section 3.2).

A keypoint can be *seen* in the picture and still not be *located* in space: where the depth around it is missing or out
of the sensor's range.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from protocol.arrays import AnyArray, Float64Array
from protocol.camera import Camera, back_project

NEAREST, FARTHEST = 1.5, 15.0
"""Metres. Depth outside of this range is not believed."""

_REACH = 3
_OFFSETS = np.arange(-_REACH, _REACH + 1)


def patch_depth(depth: ArrayLike, pixel_xy: Sequence[float]) -> float:
    """Mean depth of the 7×7 pixels around one pixel, without values that are not finite or out of range.

    Args:
        depth: (height, width) metres along the view.
        pixel_xy: x and y; a pixel's centre has integer coordinates.

    Returns:
        Metres; NaN when no value is left.

    Source: seed, section 3.2.
    """
    return float(_patch_depths(np.asarray(depth), np.asarray([pixel_xy], dtype=np.float64))[0])


def lift(depth: AnyArray, keypoints: Float64Array, camera: Camera) -> Float64Array:
    """Place keypoints in the world by the depth around them.

    Args:
        depth: (height, width) metres along the view.
        keypoints: (n, 2) pixels x and y, NaN where there is none.
        camera: what the depth was taken with.

    Returns:
        (n, 3) world frame, metres; NaN for keypoints that can't be located.

    Source: seed, section 3.2.
    """
    return back_project(keypoints, _patch_depths(depth, keypoints), camera)


def _patch_depths(depth: AnyArray, pixels: Float64Array) -> Float64Array:
    height, width = depth.shape
    known = np.all(np.isfinite(pixels), axis=1)
    # Far outside of the picture is as good as anywhere outside, and fits an integer.
    centres = np.clip(np.where(known[:, None], pixels, -1e6), -1e6, 1e6)
    columns, rows = np.floor(centres + 0.5).astype(np.int64).T
    rows, columns = rows[:, None, None] + _OFFSETS[:, None], columns[:, None, None] + _OFFSETS
    values = depth[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(np.float64)
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    # A comparison with NaN is false, so what is not finite falls out with what is out of range.
    valid = inside & (values >= NEAREST) & (values <= FARTHEST)
    count = valid.sum(axis=(1, 2))
    total = np.where(valid, values, 0.0).sum(axis=(1, 2))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
