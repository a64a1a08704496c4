"""Quality of Estimation: how far each joint's position can be trusted, in [0, 1] (thesis, section 3.3).

Three components are averaged: the share of its heatmap that stands around the joint (mass), the height of its peak
(height), and whether its place in space fits a human body (distance). docs/qoe.md decides what the thesis leaves open.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from protocol.arrays import AnyArray, BoolArray, Float32Array, Float64Array
from protocol.errors import InvalidInput
from protocol.skeleton import JOINT_COUNT, Joint

TOLERANCE = 1.5
"""T of the thesis, metres: a distance is plausible up to here, and not at all from 1.25 T on."""


@dataclass(frozen=True)
class Bone:
    """Two joints and the plausible lengths of the bone between them, in metres."""

    ends: tuple[Joint, Joint]
    shortest: float
    longest: float


UPPER_BODY_CHAIN = (
    Bone((Joint.RIGHT_WRIST, Joint.RIGHT_ELBOW), 0.25, 0.60),
    Bone((Joint.RIGHT_ELBOW, Joint.RIGHT_SHOULDER), 0.25, 0.60),
    Bone((Joint.RIGHT_SHOULDER, Joint.NECK), 0.15, 0.45),
    Bone((Joint.NECK, Joint.LEFT_SHOULDER), 0.15, 0.45),
    Bone((Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW), 0.25, 0.60),
    Bone((Joint.LEFT_ELBOW, Joint.LEFT_WRIST), 0.25, 0.60),
)
"""From the right wrist to the left one (thesis, section 3.3.2)."""

_STARTS, _ENDS = np.array([bone.ends for bone in UPPER_BODY_CHAIN]).T
_SHORTEST = np.array([bone.shortest for bone in UPPER_BODY_CHAIN])
_LONGEST = np.array([bone.longest for bone in UPPER_BODY_CHAIN])
_CHAIN = np.append(_STARTS, _ENDS[-1])
_BONES_OF = np.array([(max(place - 1, 0), min(place, len(UPPER_BODY_CHAIN) - 1)) for place in range(len(_CHAIN))])
"""The two bones of each joint of the chain; of a wrist its forearm, twice."""


@dataclass(frozen=True, eq=False)
class Quality:
    """(18,) each, in [0, 1], 1 is best; all 0 where a joint was not detected."""

    mass: Float64Array
    height: Float64Array
    distance: Float64Array
    combined: Float64Array


def quality_of_estimation(
    heatmaps: Float32Array,
    cells: NDArray[np.int64],
    points: Float64Array,
    *,
    others: NDArray[np.int64] | None = None,
) -> Quality:
    """All three components and their mean.

    Args:
        heatmaps: (18 or more, rows, columns), one for each joint.
        cells: (18, 2) row and column of each joint in its heatmap; negative where it was not detected.
        points: (18, 3) metres, NaN where a joint is not located.
        others: (n, 18, 2) cells of other people, whose peaks then don't lower this person's mass.

    Raises:
        InvalidInput: a heatmap has a value that is not finite, or a cell is outside.

    Source: thesis, section 3.3.3.
    """
    masked = _masked(heatmaps[:JOINT_COUNT])
    detected = np.flatnonzero((cells >= 0).all(axis=1))
    places = cells[detected]
    _require_inside(places, masked.shape[1:])
    mass, height, distance = np.zeros((3, JOINT_COUNT))
    mass[detected] = _shares(masked, detected, places, others)
    height[detected] = np.minimum(masked[detected, places[:, 0], places[:, 1]], 1.0)
    distance[detected] = distance_quality(points)[detected]
    return Quality(mass, height, distance, combined=combined_quality(mass, height, distance))


def combined_quality(mass: Float64Array, height: Float64Array, distance: Float64Array) -> Float64Array:
    """(18,) the mean of the three components. Source: thesis, section 3.3.3."""
    return (mass + height + distance) / 3


def heatmap_cell(pixel_xy: Sequence[float], image_size: Sequence[int], map_size: Sequence[int]) -> tuple[int, int]:
    """The heatmap's cell that a pixel falls into.

    Args:
        pixel_xy: x and y in the image that the network saw.
        image_size: that image's (height, width).
        map_size: the heatmap's (height, width).

    Returns:
        Row and column, clipped into the map.

    Raises:
        InvalidInput: the pixel is not finite.

    Source: thesis, section 3.3.1.
    """
    x, y = (float(value) for value in pixel_xy)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InvalidInput(f"the pixel ({x}, {y}) is in no cell of the heatmap")
    [[row, column]] = heatmap_cells(np.array([[x, y]]), image_size, map_size)
    return int(row), int(column)


def heatmap_cells(pixels: Float64Array, image_size: Sequence[int], map_size: Sequence[int]) -> NDArray[np.int64]:
    """The cells that pixels fall into; see `heatmap_cell`.

    Args:
        pixels: (n, 2) x and y, NaN where there is none.

    Returns:
        (n, 2) row and column; -1 where there is no pixel.
    """
    size = np.array(map_size)
    scaled = np.floor(pixels[:, ::-1] * size / np.array(image_size))
    return np.where(np.isnan(scaled), -1, np.minimum(np.maximum(scaled, 0), size - 1)).astype(np.int64)


def nearest_cells(places: Float64Array, map_size: Sequence[int]) -> NDArray[np.int64]:
    """The cells of the heatmap that places in it are nearest to.

    Args:
        places: (..., 2) column and row in cells, centres at integers, NaN where there is none.

    Returns:
        (..., 2) row and column, clipped into the map; -1 where there is no place.
    """
    nearest = np.floor(places[..., ::-1] + 0.5)
    highest = np.array(map_size) - 1
    return np.where(np.isnan(nearest), -1, np.minimum(np.maximum(nearest, 0), highest)).astype(np.int64)


def mass_quality(heatmap: ArrayLike, cell: Sequence[int]) -> float:
    """The share of the heatmap's mass that stands in one piece with the joint's cell.

    Args:
        heatmap: (rows, columns) one joint's.
        cell: row and column of the joint.

    Returns:
        In [0, 1]; 0 if the cell itself is below the heatmap's mean or not above 0.

    Raises:
        InvalidInput: the heatmap has no two axes or a value that is not finite, or the cell is outside.

    Source: thesis, section 3.3.1.
    """
    masked, at = _masked(np.asarray(heatmap)[None]), np.asarray([cell], dtype=np.int64)
    _require_inside(at, masked.shape[1:])
    return float(_shares(masked, np.zeros(1, dtype=np.int64), at)[0])


def height_quality(heatmap: ArrayLike, cell: Sequence[int]) -> float:
    """How high the heatmap stands at the joint's cell, clipped to [0, 1]; 0 where it is below its mean.

    Args:
        heatmap: (rows, columns) one joint's.
        cell: row and column of the joint.

    Raises:
        InvalidInput: as `mass_quality`.

    Source: thesis, section 3.3.1.
    """
    masked, at = _masked(np.asarray(heatmap)[None]), np.asarray([cell], dtype=np.int64)
    _require_inside(at, masked.shape[1:])
    return float(min(masked[0, at[0, 0], at[0, 1]], 1.0))


def distance_quality(points: ArrayLike) -> Float64Array:
    """Plausibility of each joint's place in space: near the rest of the body, and bones of human length.

    Args:
        points: (18, 3) metres, NaN for joints that are not located.

    Returns:
        (18,) in [0, 1]; 0 for joints that are not located.

    Source: thesis, section 3.3.2.
    """
    positions = np.asarray(points, dtype=np.float64)
    if positions.shape != (JOINT_COUNT, 3):
        raise InvalidInput(f"points have the shape {positions.shape}, not {(JOINT_COUNT, 3)}")
    located = np.all(np.isfinite(positions), axis=1)
    quality = _general_rule(positions, located)
    quality[_CHAIN] = _chain_rule(positions, located, otherwise=quality[_CHAIN])
    return quality


def _masked(heatmaps: AnyArray) -> Float64Array:
    """M of the thesis for (n, rows, columns): a heatmap where it reaches its own mean and 0, and 0 elsewhere."""
    if heatmaps.ndim != 3 or heatmaps.size == 0:
        raise InvalidInput(f"heatmaps have rows and columns, not the shape {heatmaps.shape[1:]}")
    values = heatmaps.astype(np.float64)
    with np.errstate(invalid="ignore"):
        means = values.mean(axis=(1, 2))
    # A sum is finite only if all its terms are.
    if not np.isfinite(means).all():
        raise InvalidInput("a heatmap has values that are not finite; the network or its weights are damaged")
    return np.where(values >= np.maximum(means, 0.0)[:, None, None], values, 0.0)


def _require_inside(cells: NDArray[np.int64], size: tuple[int, ...]) -> None:
    outside = ((cells < 0) | (cells >= size)).any(axis=1)
    if outside.any():
        raise InvalidInput(f"the cells {cells[outside].tolist()} are outside the heatmap of {size}")


def _shares(
    masked: Float64Array,
    joints: NDArray[np.int64],
    cells: NDArray[np.int64],
    others: NDArray[np.int64] | None = None,
) -> Float64Array:
    """(k,) share of each joint's map that stands in the component of its cell; 0 where the cell itself is empty.

    Args:
        masked: (n, rows, columns) M of the maps.
        joints: (k,) which maps.
        cells: (k, 2) row and column in each.
        others: (people, n, 2) cells of others, negative where they have none: their components are left out.
    """
    count, rows, columns = masked.shape
    # All maps at once, one above the other with an empty row between, so that no component reaches into the next map.
    stands = masked > 0.0
    stacked = np.zeros((count, rows + 1, columns), dtype=bool)
    stacked[:, :rows] = stands
    # 8-connected, as the thesis's OpenCV call was; 4-connected splits diagonal peaks and lowers the mass.
    found, labelled = cv2.connectedComponents(stacked.view(np.uint8).reshape(-1, columns), connectivity=8)
    labels = np.asarray(labelled, dtype=np.int32).reshape(stacked.shape)
    places = np.flatnonzero(stacked)
    at, map_of = labels.reshape(-1)[places], np.zeros(found, dtype=np.int64)
    map_of[at] = places // ((rows + 1) * columns)
    sums = np.bincount(at, weights=masked[stands], minlength=found).astype(np.float64)
    own = labels[joints, cells[:, 0], cells[:, 1]]
    kept = sums if others is None else _without_others(sums, own, labels, others)
    totals = np.bincount(map_of, weights=kept, minlength=count)[joints]
    return np.where(own > 0, sums[own] / np.where(own > 0, totals, 1.0), 0.0)


def _without_others(
    sums: Float64Array, own: NDArray[np.int32], labels: NDArray[np.int32], others: NDArray[np.int64]
) -> Float64Array:
    """The components' sums, 0 for those that hold another person's joint and none of this person's."""
    person, joint = np.nonzero((others >= 0).all(axis=2))
    row, column = others[person, joint].T
    kept = sums.copy()
    kept[labels[joint, row, column]] = 0.0
    kept[own] = sums[own]
    return kept


def _implausibility(distance: Float64Array) -> Float64Array:
    """w_T of the thesis: 0 up to T, 1 from 1.25 T, straight between."""
    return np.minimum(np.maximum(4.0 / TOLERANCE * (distance - TOLERANCE), 0.0), 1.0)


def _general_rule(positions: Float64Array, located: BoolArray) -> Float64Array:
    """By the distance to the mean of the other located joints; 0 where there is none, and for joints not located."""
    others = located & ~np.eye(JOINT_COUNT, dtype=bool)
    count = others.sum(axis=1)
    known = np.where(located[:, None], positions, 0.0)
    away = known - others @ known / np.maximum(count, 1)[:, None]
    distance = np.sqrt((away * away).sum(axis=1))
    return np.where(located & (count > 0), 1.0 - _implausibility(distance), 0.0)


def _chain_rule(positions: Float64Array, located: BoolArray, *, otherwise: Float64Array) -> Float64Array:
    """(7,) by the lengths of the bones from wrist to wrist; `otherwise` (7,) where no bone of a joint is measured."""
    ends = np.where(located[:, None], positions, np.nan)
    bones = ends[_ENDS] - ends[_STARTS]
    # A bone that can't be measured has no length: NaN, with which no comparison is true.
    lengths = np.sqrt((bones * bones).sum(axis=1))
    measured, short = ~np.isnan(lengths)[_BONES_OF], (lengths < _SHORTEST)[_BONES_OF]
    plausible = ((lengths >= _SHORTEST) & (lengths <= _LONGEST))[_BONES_OF]
    excess = np.where(measured, (lengths - _LONGEST)[_BONES_OF], 0.0).sum(axis=1) / np.maximum(measured.sum(axis=1), 1)
    correct = plausible.any(axis=1)
    judged = np.where(correct, 1.0, np.where(short.any(axis=1), 0.0, 1.0 - _implausibility(excess)))
    applies = measured.any(axis=1)
    # A wrist is judged by its forearm only at a correct elbow.
    applies[[0, -1]] &= correct[[1, -2]]
    return np.where(applies, judged, otherwise)
