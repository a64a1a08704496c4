"""The part of a frame that the network looks at."""

import numpy as np

from protocol.arrays import Float64Array
from protocol.region import Region

_MARGIN_SIDEWAYS, _MARGIN_UPRIGHT = 0.25, 0.18
_LEAST_SIDE = 96
"""Pixels. A smaller crop would show the network nothing but a blur."""


def around_person(keypoints: Float64Array, frame: Region, aspect: float) -> Region:
    """The region that shows a person whole and large.

    Args:
        keypoints: (n, 2) pixels x and y of those found in the whole frame, NaN for others; at least one is found.
        frame: the whole frame.
        aspect: width to height that the network sees without distortion.
    """
    lowest, highest = np.nanmin(keypoints, axis=0), np.nanmax(keypoints, axis=0)
    width, height = highest - lowest
    margin = max(_MARGIN_UPRIGHT * height, _MARGIN_SIDEWAYS * width)
    width, height = (max(side + 2 * margin, _LEAST_SIDE) for side in (width, height))
    width, height = max(width, height * aspect), max(height, width / aspect)
    width, height = min(round(width), frame.width), min(round(height), frame.height)
    x, y = (lowest + highest) / 2
    left = min(max(round(x - width / 2), 0), frame.width - width)
    top = min(max(round(y - height / 2), 0), frame.height - height)
    return Region(left, top, width, height)
