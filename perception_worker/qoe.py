"""Quality of Estimation: how far each joint's position can be trusted, in [0, 1] (seed, section 3.3).

Three signs are averaged: how much of its heatmap stands around the joint (mass), how high its peak is (height), and
whether its place in space fits a human body (distance). What the seed leaves open is decided in docs/qoe.md.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.errors import InvalidInput
from protocol.skeleton import JOINT_COUNT, Joint

TOLERANCE = 1.5
"""T of the seed, metres: a distance is plausible up to here, and not at all from 1.25 T on."""


@dataclass(frozen=True)
class Bone:
    """Two joints and the plausible lengths of what is between them, in metres."""

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
"""From the right wrist to the left one (seed, section 3.3.2)."""

_WRISTS = (
    (Joint.RIGHT_WRIST, Joint.RIGHT_ELBOW, UPPER_BODY_CHAIN[0]),
    (Joint.LEFT_WRIST, Joint.LEFT_ELBOW, UPPER_BODY_CHAIN[-1]),
)


@dataclass(frozen=True, eq=False)
class Quality:
    """(18,) each, in [0, 1], 1 is best; all 0 where a joint was not detected."""

    mass: Float64Array
    height: Float64Array
    distance: Float64Array
    combined: Float64Array


def quality_of_estimation(heatmaps: Float32Array, cells: NDArray[np.int64], points: Float64Array) -> Quality:
    """All three components and their mean.

    Args:
        heatmaps: (18 or more, rows, columns), one for each joint.
        cells: (18, 2) row and column of each joint in its heatmap; negative where it was not detected.
        points: (18, 3) metres, NaN where a joint is not located.

    Source: seed, section 3.3.3.
    """
    mass, height = np.zeros(JOINT_COUNT), np.zeros(JOINT_COUNT)
    detected = np.all(cells >= 0, axis=1)
    for joint in np.flatnonzero(detected):
        masked = _masked(heatmaps[joint])
        cell = int(cells[joint, 0]), int(cells[joint, 1])
        mass[joint], height[joint] = _component_share(masked, cell), _height(masked, cell)
    distance = np.where(detected, distance_quality(points), 0.0)
    return Quality(mass, height, distance, combined=(mass + height + distance) / 3)


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

    Source: seed, section 3.3.1.
    """
    x, y = (float(value) for value in pixel_xy)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InvalidInput(f"the pixel ({x}, {y}) is in no cell of the heatmap")
    row, column = (
        min(max(math.floor(value * int(cells) / int(pixels)), 0), int(cells) - 1)
        for value, pixels, cells in zip((y, x), image_size, map_size, strict=True)
    )
    return row, column


def mass_quality(heatmap: ArrayLike, cell: Sequence[int]) -> float:
    """The share of the heatmap's mass that stands in one piece with the joint's cell.

    Args:
        heatmap: (rows, columns) one joint's.
        cell: row and column of the joint.

    Returns:
        In [0, 1]; 0 if the cell itself is below the heatmap's mean or not above 0.

    Source: seed, section 3.3.1.
    """
    masked = _masked(heatmap)
    return _component_share(masked, _inside(cell, masked))


def height_quality(heatmap: ArrayLike, cell: Sequence[int]) -> float:
    """How high the heatmap stands at the joint's cell, clipped to [0, 1]; 0 where it is below its mean.

    Args:
        heatmap: (rows, columns) one joint's.
        cell: row and column of the joint.

    Source: seed, section 3.3.1.
    """
    masked = _masked(heatmap)
    return _height(masked, _inside(cell, masked))


def distance_quality(points: ArrayLike) -> Float64Array:
    """Plausibility of each joint's place in space: near the rest of the body, and bones of human length.

    Args:
        points: (18, 3) metres, NaN for joints that are not located.

    Returns:
        (18,) in [0, 1]; 0 for joints that are not located.

    Source: seed, section 3.3.2.
    """
    positions = np.asarray(points, dtype=np.float64)
    if positions.shape != (JOINT_COUNT, 3):
        raise InvalidInput(f"points have the shape {positions.shape}, not {(JOINT_COUNT, 3)}")
    located = np.all(np.isfinite(positions), axis=1)
    quality = _general_rule(positions, located)
    for joint, value in _chain_rule(positions, located, otherwise=quality).items():
        quality[joint] = value
    return np.where(located, quality, 0.0)


def _masked(heatmap: ArrayLike) -> Float64Array:
    """M of the seed: the heatmap where it reaches its own mean and 0, and 0 elsewhere."""
    values = np.asarray(heatmap, dtype=np.float64)
    if values.ndim != 2 or values.size == 0:
        raise InvalidInput(f"a heatmap has rows and columns, not the shape {values.shape}")
    return np.where(values >= max(float(values.mean()), 0.0), values, 0.0)


def _inside(cell: Sequence[int], heatmap: Float64Array) -> tuple[int, int]:
    row, column = (int(index) for index in cell)
    if not (0 <= row < heatmap.shape[0] and 0 <= column < heatmap.shape[1]):
        raise InvalidInput(f"the cell {(row, column)} is outside the heatmap of {heatmap.shape}")
    return row, column


def _component_share(masked: Float64Array, cell: tuple[int, int]) -> float:
    if not masked[cell] > 0:
        return 0.0
    # 8-connected, as the seed's OpenCV call was; 4-connected splits diagonal peaks and lowers the mass.
    _, labels = cv2.connectedComponents((masked > 0).astype(np.uint8), connectivity=8)
    component = np.where(labels == labels[cell], masked, 0.0)
    # Both sums run over the same cells in the same order: a heatmap of one component has exactly 1.
    return float(component.sum() / masked.sum())


def _height(masked: Float64Array, cell: tuple[int, int]) -> float:
    return float(np.clip(masked[cell], 0.0, 1.0))


def _implausibility(distance: ArrayLike) -> Float64Array:
    """w_T of the seed: 0 up to T, 1 from 1.25 T, straight between."""
    return np.clip(4.0 / TOLERANCE * (np.asarray(distance, dtype=np.float64) - TOLERANCE), 0.0, 1.0)


def _general_rule(positions: Float64Array, located: BoolArray) -> Float64Array:
    """By the distance to the mean of the other located joints; 0 where there is none."""
    others = located & ~np.eye(JOINT_COUNT, dtype=bool)
    count = others.sum(axis=1)
    known = np.where(located[:, None], positions, 0.0)
    distance = np.linalg.norm(known - others @ known / np.maximum(count, 1)[:, None], axis=1)
    return np.where(located & (count > 0), 1.0 - _implausibility(distance), 0.0)


def _chain_rule(positions: Float64Array, located: BoolArray, *, otherwise: Float64Array) -> dict[Joint, float]:
    """By the lengths of the bones from wrist to wrist; `otherwise` is the quality where these say nothing."""
    lengths = {
        bone: float(np.linalg.norm(positions[bone.ends[0]] - positions[bone.ends[1]]))
        for bone in UPPER_BODY_CHAIN
        if located[bone.ends[0]] and located[bone.ends[1]]
    }
    inner = {before.ends[1]: (before, after) for before, after in pairwise(UPPER_BODY_CHAIN)}
    correct = {joint for joint, bones in inner.items() if any(_in_range(bone, lengths) for bone in bones)}
    quality = {
        joint: 1.0 if joint in correct else _incorrect_quality(bones, lengths, otherwise[joint])
        for joint, bones in inner.items()
    }
    for wrist, elbow, forearm in _WRISTS:
        if elbow in correct and _in_range(forearm, lengths):
            quality[wrist] = 1.0
        elif elbow in correct:
            quality[wrist] = _incorrect_quality((forearm,), lengths, otherwise[wrist])
    return quality


def _in_range(bone: Bone, lengths: Mapping[Bone, float]) -> bool:
    """Whether the bone has a plausible length; one that can't be measured has none."""
    return bone in lengths and bone.shortest <= lengths[bone] <= bone.longest


def _incorrect_quality(bones: Sequence[Bone], lengths: Mapping[Bone, float], otherwise: float) -> float:
    """Quality of a joint none of whose bones has a plausible length."""
    measured = [bone for bone in bones if bone in lengths]
    if not measured:
        return float(otherwise)
    if any(lengths[bone] < bone.shortest for bone in measured):
        return 0.0
    excess = sum(lengths[bone] - bone.longest for bone in measured) / len(measured)
    return float(1.0 - _implausibility(excess))
