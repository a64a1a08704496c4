"""The region of a picture that shows a person large."""

from typing import NamedTuple

import numpy as np

from protocol.arrays import Float64Array
from protocol.region import Region

_MARGIN_SIDEWAYS, _MARGIN_UPRIGHT = 0.25, 0.18
"""Of the width and of the height of the joints' box: flesh, hair and hands reach beyond the joints."""

_LEAST_MARGIN = 12.0
"""Pixels."""

_LEAST_SIDE = 96
"""Pixels. A smaller region would show the network nothing but a blur."""

_MOST_OF_PICTURE = 0.8
"""Share of a picture beyond which a region saves no time."""


class Box(NamedTuple):
    """Lowest and highest x and y, in pixels, (2,) each."""

    lowest: Float64Array
    highest: Float64Array

    @classmethod
    def around(cls, pixels: Float64Array) -> "Box":
        """The box of pixels x and y (n, 2), of which one at least is not NaN."""
        return cls(np.nanmin(pixels, axis=0), np.nanmax(pixels, axis=0))


def around_person(pixels: Float64Array, area: Region, aspect: float, reach: float = 0.0) -> Region | None:
    """The region that shows a person whole and large.

    Args:
        pixels: (n, 2) x and y of the joints, NaN where one is not known; one at least is.
        area: the part of the picture at hand.
        aspect: width to height that the network sees without distortion.
        reach: pixels that the joints may be away from there.

    Returns:
        A region in `area` of this aspect, to half a pixel; None where none holds the part of the person that is in it,
        where nothing of the person is, or where it would be most of the picture.
    """
    whole, box = _box_of(area), Box.around(pixels)
    seen = Box(np.maximum(box.lowest, whole.lowest), np.minimum(box.highest, whole.highest))
    if not (seen.lowest <= seen.highest).all():
        return None
    width, height = _size(box, area, aspect, reach)
    if (seen.highest - seen.lowest > (width, height)).any() or width * height > _MOST_OF_PICTURE * _pixels(area):
        return None
    left, top = np.rint((seen.lowest + seen.highest + 1 - (width, height)) / 2).astype(int)
    return Region(
        left=min(max(int(left), area.left), area.right - width),
        top=min(max(int(top), area.top), area.bottom - height),
        width=width,
        height=height,
    )


def at_inner_edge(pixels: Float64Array, region: Region, area: Region, cell: float) -> bool:
    """Whether a joint lies within a cell of an edge of the region behind which the picture goes on.

    Args:
        pixels: (n, 2) x and y, NaN where there is none.
        cell: pixels.
    """
    x, y = pixels[np.isfinite(pixels[:, 0])].T
    return bool(
        (region.left > area.left and (x < region.left - 0.5 + cell).any())
        or (region.right < area.right and (x > region.right - 0.5 - cell).any())
        or (region.top > area.top and (y < region.top - 0.5 + cell).any())
        or (region.bottom < area.bottom and (y > region.bottom - 0.5 - cell).any())
    )


def _size(box: Box, area: Region, aspect: float, reach: float) -> tuple[int, int]:
    """Width and height with a margin, of the aspect, and no larger than fits."""
    width, height = box.highest - box.lowest
    margin = reach + max(_MARGIN_UPRIGHT * height, _MARGIN_SIDEWAYS * width, _LEAST_MARGIN)
    width, height = (max(side + 2 * margin, _LEAST_SIDE) for side in (width, height))
    width = min(max(width, height * aspect), area.width, area.height * aspect)
    return max(int(np.rint(width)), 1), max(int(np.rint(width / aspect)), 1)


def _box_of(area: Region) -> Box:
    return Box(np.array([area.left, area.top], float), np.array([area.right - 1, area.bottom - 1], float))


def _pixels(area: Region) -> int:
    return area.width * area.height
