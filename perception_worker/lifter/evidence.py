"""The depths around keypoints: quantiles of a window of a few pixels, and of one as large as a body's part."""

import numpy as np

from protocol.arrays import AnyArray, Float32Array, Float64Array
from protocol.joint_arrays import EVIDENCE_SIZE
from protocol.pose_estimate import Evidence
from protocol.skeleton import JOINT_COUNT, Joint

NEAREST, FARTHEST = 0.3, 15.0
"""Metres, the range of a depth camera. Depth outside of it is ignored."""

QUANTILES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)
SHARE, LEAST, FRONT = 0, 1, 3
"""Columns of the evidence: the share of depths in range, the nearest of them, and the lower quartile."""

PART_REACH = 0.09
"""Metres from a joint to the edge of its wide window: an upper arm's thickness, or a head's half."""

_TORSO = np.array(
    [Joint.NECK, Joint.RIGHT_SHOULDER, Joint.LEFT_SHOULDER, Joint.RIGHT_HIP, Joint.LEFT_HIP], dtype=np.intp
)
_LEAST_TORSO = 2

_NARROW = np.arange(-3.0, 4.0)
_WIDE_STEPS = np.linspace(-1.0, 1.0, 9)
_WIDE_LEAST, _WIDE_MOST = 4.0, 48.0
"""Pixels from a wide window's middle to its edge."""


def evidence_of(depth: AnyArray, keypoints: Float64Array, focal: float) -> Evidence:
    """The evidence around a person's keypoints.

    Args:
        depth: (height, width) metres along the view.
        keypoints: (18, 2) pixels x and y of this picture, NaN where there is none.
        focal: pixels per unit of slope.
    """
    narrow = _quantiles(_sampled(depth, keypoints, _NARROW))
    front = median_of_known(front_depths(narrow[None]))[0]
    reach = np.clip(PART_REACH * focal / front if np.isfinite(front) else 0.0, _WIDE_LEAST, _WIDE_MOST)
    return Evidence(narrow=narrow, wide=_quantiles(_sampled(depth, keypoints, np.rint(reach * _WIDE_STEPS))))


def front_depths(narrow: Float32Array) -> Float64Array:
    """(n, 18) metres to the surface in front of each joint that tells how far the body is; NaN for other joints.

    Those are the joints of the torso, where enough of them are known, else all.

    Args:
        narrow: (n, 18, 7) evidence.
    """
    front = narrow[:, :, FRONT].astype(np.float64)
    torso = np.full_like(front, np.nan)
    torso[:, _TORSO] = front[:, _TORSO]
    enough = np.isfinite(torso).sum(axis=1) >= _LEAST_TORSO
    return np.where(enough[:, None], torso, front)


def median_of_known(values: Float64Array) -> Float64Array:
    """(n, …) the median of each row (n, m, …) without NaN values; NaN where all are."""
    rising = np.sort(values, axis=1)
    count = np.isfinite(values).sum(axis=1)
    lower, upper = (np.expand_dims(np.maximum(place, 0), 1) for place in ((count - 1) // 2, count // 2))
    at = [np.take_along_axis(rising, np.minimum(place, values.shape[1] - 1), axis=1)[:, 0] for place in (lower, upper)]
    return (at[0] + at[1]) / 2


def _sampled(depth: AnyArray, keypoints: Float64Array, offsets: Float64Array) -> Float64Array:
    """(18, k²) the depths on a square lattice around each keypoint; NaN out of the picture or of range."""
    height, width = depth.shape
    # Clipped far outside of the picture, so that it fits an integer; NaN goes there as well.
    centres = np.clip(np.where(np.isnan(keypoints), -1e6, keypoints), -1e6, 1e6)
    columns, rows = np.floor(centres + 0.5).astype(np.intp).T
    steps = offsets.astype(np.intp)
    rows, columns = rows[:, None, None] + steps[:, None], columns[:, None, None] + steps
    values = depth[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(np.float64)
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    believed = inside & (values >= NEAREST) & (values <= FARTHEST)
    return np.where(believed, values, np.nan).reshape(len(keypoints), -1)


def _quantiles(depths: Float64Array) -> Float32Array:
    """(18, 7) evidence of the depths (18, k) in a window."""
    rising = np.sort(depths, axis=1)
    count = np.isfinite(depths).sum(axis=1)
    places = np.floor(np.array(QUANTILES) * np.maximum(count - 1, 0)[:, None] + 0.5).astype(np.intp)
    evidence = np.empty((JOINT_COUNT, EVIDENCE_SIZE), np.float32)
    evidence[:, SHARE] = count / depths.shape[1]
    evidence[:, LEAST:] = np.take_along_axis(rising, places, axis=1)
    return evidence
