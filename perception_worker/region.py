"""The part of a frame that the network looks at, and the way between its cells and the frame's pixels."""

from dataclasses import dataclass

import numpy as np

from protocol.arrays import Float64Array, UInt8Array

_MARGIN_SIDEWAYS, _MARGIN_UPRIGHT = 0.25, 0.18
_LEAST_SIDE = 96
"""Pixels. A smaller crop would show the network nothing but a blur."""


@dataclass(frozen=True)
class Region:
    """A rectangle of whole pixels inside a frame."""

    left: int
    top: int
    width: int
    height: int

    @classmethod
    def whole(cls, height: int, width: int) -> "Region":
        """All of a frame."""
        return cls(0, 0, width, height)

    def part(self, rgb: UInt8Array) -> UInt8Array:
        """What a picture (rows, columns, 3) shows of the region; no copy."""
        return rgb[self.top : self.top + self.height, self.left : self.left + self.width]

    def pixels(self, cells: Float64Array, map_size: tuple[int, int]) -> Float64Array:
        """Columns and rows of a map of the region (n, 2), centres at integers, to pixels x and y of the frame."""
        rows, columns = map_size
        scale = np.array([self.width / columns, self.height / rows])
        return (cells + 0.5) * scale - 0.5 + (self.left, self.top)

    def inside(self, pixels: Float64Array) -> Float64Array:
        """Pixels of the frame (n, 2) as pixels of the region."""
        return pixels - (self.left, self.top)


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
