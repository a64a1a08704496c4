"""From keypoints in the picture to points in the world (thesis, section 3.2).

A keypoint can be *seen* in the picture and still not be *located* in space, if the depth around it is missing or out of
the sensor's range. Which of the depths around it belongs to the joint is a choice: the thesis's mean mixes a thin arm
with the wall behind it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from perception_worker.median import median
from protocol.arrays import AnyArray, Float64Array
from protocol.camera import Camera, back_project
from protocol.config import PerceptionConfig
from protocol.pose_estimate import Lifting

NEAREST, FARTHEST = 1.5, 15.0
"""Metres. Depth outside of this range is ignored."""

NEAR_QUANTILE = 0.25
"""The quantile of depths at which the surface in front is found, so that a few stray nearer depths are ignored."""

SURFACE_DEPTH = 0.3
"""Metres. A depth this much nearer or farther belongs to another surface."""

BODY_REACH = 1.5
"""Metres from the middle of a body to its farthest joint: at most 1.43 in the people we draw, with arms raised."""

_REACH = 3
_OFFSETS = np.arange(-_REACH, _REACH + 1)


@dataclass(frozen=True, eq=False)
class Windows:
    """The depths in the 7×7 pixels around each of n keypoints.

    Attributes:
        depths: (n, 49) metres, rising; ignored ones come last, as infinity.
        count: (n,) how many are not ignored.
    """

    depths: Float64Array
    count: NDArray[np.int64]

    @property
    def spread(self) -> Float64Array:
        """(n,) metres between the nearest and the farthest believed depth; NaN where there is none."""
        return self._at(self.count - 1) - self._at(np.zeros_like(self.count))

    def quantile(self, share: float) -> Float64Array:
        """(n,) the believed depth below which `share` of the others are, the lower where it lies between two."""
        return self._at(np.floor(share * (self.count - 1)).astype(np.int64))

    def mean(self, *, nearest: Float64Array | float = 0.0, farthest: Float64Array | float = FARTHEST) -> Float64Array:
        """(n,) mean of the believed depths from `nearest` to `farthest`; NaN where there is none."""
        lowest, highest = np.expand_dims(nearest, -1), np.expand_dims(farthest, -1)
        taken = (self.depths >= lowest) & (self.depths <= highest)
        count = taken.sum(axis=1)
        total = np.where(taken, self.depths, 0.0).sum(axis=1)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def _at(self, index: NDArray[np.int64]) -> Float64Array:
        depth = np.take_along_axis(self.depths, np.maximum(index, 0)[:, None], axis=1)[:, 0]
        return np.where(self.count > 0, depth, np.nan)


def mean_depth(windows: Windows) -> Float64Array:
    """(n,) metres: the mean of all (thesis, section 3.2)."""
    return windows.mean()


def median_depth(windows: Windows) -> Float64Array:
    """(n,) metres: the median, the mean of the middle two where their number is even."""
    below = windows.quantile(0.5)
    above = windows._at(windows.count // 2)
    return (below + above) / 2


def nearest_depth(windows: Windows) -> Float64Array:
    """(n,) metres: the mean of the surface in front, which is what lies about the depth at the lower quartile."""
    front = windows.quantile(NEAR_QUANTILE)
    return windows.mean(nearest=front - SURFACE_DEPTH, farthest=front + SURFACE_DEPTH)


LIFTINGS: Mapping[Lifting, Callable[[Windows], Float64Array]] = {
    "mean": mean_depth,
    "median": median_depth,
    "nearest": nearest_depth,
}
"""The depth that each choice takes out of a window."""


def surface_lifting(config: PerceptionConfig) -> Lifting:
    """Which of the depths a worker of this configuration, settled by its profile, takes for the joint's.

    A learned lifter needs no surface; where one is asked for all the same, it is the one in front.
    """
    return "nearest" if config.lifting == "learned" else msgspec.convert(config.lifting, Lifting)


def patch_depth(depth: ArrayLike, pixel_xy: Sequence[float]) -> float:
    """Mean depth of the 7×7 pixels around one pixel, without values that are not finite or out of range.

    Args:
        depth: (height, width) metres along the view.
        pixel_xy: x and y; a pixel's centre has integer coordinates.

    Returns:
        Metres; NaN when no value is left.

    Source: thesis, section 3.2.
    """
    return float(mean_depth(windows_around(np.asarray(depth), np.asarray([pixel_xy], dtype=np.float64)))[0])


def lift(windows: Windows, keypoints: Float64Array, camera: Camera, lifting: Lifting = "mean") -> Float64Array:
    """Place keypoints in the world by the depth around them.

    Args:
        windows: of `windows_around`.
        keypoints: (n, 2) pixels x and y, NaN where there is none.
        camera: of the depth.

    Returns:
        (n, 3) world frame, metres; NaN for keypoints that can't be located.

    Source: thesis, section 3.2.
    """
    return back_project(keypoints, LIFTINGS[lifting](windows), camera)


def within_reach(points: Float64Array) -> Float64Array:
    """(n, 3) one person's points, NaN where one is too far from the middle of the others to be of the same body.

    A keypoint at the edge of a limb may have the depth of the wall behind it.

    Args:
        points: (n, 3) metres, NaN where a joint is not located.
    """
    located = np.isfinite(points).all(axis=1)
    if not located.any():
        return points
    away = np.linalg.norm(points - median(points[located]), axis=1)
    return np.where((away <= BODY_REACH)[:, None], points, np.nan)


def windows_around(depth: AnyArray, keypoints: Float64Array) -> Windows:
    """The believed depths around keypoints.

    Args:
        depth: (height, width) metres along the view.
        keypoints: (n, 2) pixels x and y, NaN where there is none.
    """
    height, width = depth.shape
    known = np.all(np.isfinite(keypoints), axis=1)
    # Clipped far outside of the picture, so that it fits an integer.
    centres = np.clip(np.where(known[:, None], keypoints, -1e6), -1e6, 1e6)
    columns, rows = np.floor(centres + 0.5).astype(np.int64).T
    rows, columns = rows[:, None, None] + _OFFSETS[:, None], columns[:, None, None] + _OFFSETS
    values = depth[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(np.float64)
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    # A comparison with NaN is false, so values that are not finite drop out with those out of range.
    believed = (inside & (values >= NEAREST) & (values <= FARTHEST)).reshape(len(keypoints), -1)
    depths = np.sort(np.where(believed, values.reshape(believed.shape), np.inf), axis=1)
    return Windows(depths, believed.sum(axis=1))
