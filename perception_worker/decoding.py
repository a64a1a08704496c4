"""From the network's maps to one person's keypoints.

Peaks of the heatmaps are the candidates for each joint; the part-affinity fields tell which candidates belong to the
same limb; limbs that share a candidate make a skeleton. One person is looked for: the skeleton with the most keypoints.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception_worker.network import NetworkOutput
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.skeleton import JOINT_COUNT, Joint

MOST_PEAKS = 16
"""Candidates for one joint; lower peaks are left out, so that noise can't make decoding slow."""

SAMPLES = 10
"""Places along a limb where the field is looked at."""

LEAST_ALIGNMENT = 0.05
"""A sample supports the limb when the field's component along it is above this."""

LEAST_SUPPORT = 0.7
"""Share of a limb's samples that must support it."""

LIMB_FIELDS: tuple[tuple[Joint, Joint, int], ...] = (
    (Joint.NECK, Joint.RIGHT_SHOULDER, 12),
    (Joint.NECK, Joint.LEFT_SHOULDER, 20),
    (Joint.RIGHT_SHOULDER, Joint.RIGHT_ELBOW, 14),
    (Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST, 16),
    (Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW, 22),
    (Joint.LEFT_ELBOW, Joint.LEFT_WRIST, 24),
    (Joint.NECK, Joint.RIGHT_HIP, 0),
    (Joint.RIGHT_HIP, Joint.RIGHT_KNEE, 2),
    (Joint.RIGHT_KNEE, Joint.RIGHT_ANKLE, 4),
    (Joint.NECK, Joint.LEFT_HIP, 6),
    (Joint.LEFT_HIP, Joint.LEFT_KNEE, 8),
    (Joint.LEFT_KNEE, Joint.LEFT_ANKLE, 10),
    (Joint.NECK, Joint.NOSE, 28),
    (Joint.NOSE, Joint.RIGHT_EYE, 30),
    (Joint.RIGHT_EYE, Joint.RIGHT_EAR, 34),
    (Joint.NOSE, Joint.LEFT_EYE, 32),
    (Joint.LEFT_EYE, Joint.LEFT_EAR, 36),
    (Joint.RIGHT_SHOULDER, Joint.RIGHT_EAR, 18),
    (Joint.LEFT_SHOULDER, Joint.LEFT_EAR, 26),
)
"""Each limb and the channel of its field's x component; the y component is the next one. The order is OpenPose's."""


@dataclass(frozen=True, eq=False)
class Peaks:
    """Local maxima of the heatmaps, by joint and then by falling height.

    Attributes:
        joint: (n,) whose heatmap.
        position: (n, 2) column and row, refined to fractions of a cell.
        height: (n,) value of the heatmap.
    """

    joint: NDArray[np.int64]
    position: Float64Array
    height: Float64Array


def decode(output: NetworkOutput, threshold: float) -> Float64Array:
    """The keypoints of the person who shows the most of them; between equals, of the higher peaks.

    Args:
        output: the network's maps.
        threshold: height that a peak must exceed.

    Returns:
        (18, 2) column and row in cells, NaN for joints that were not detected.
    """
    peaks = find_peaks(output.heatmaps, threshold)
    skeletons = group(peaks, output.pafs)
    keypoints = np.full((JOINT_COUNT, 2), np.nan)
    if skeletons:
        best = max(skeletons, key=lambda skeleton: (len(skeleton), peaks.height[list(skeleton.values())].sum()))
        keypoints[list(best)] = peaks.position[list(best.values())]
    return keypoints


def find_peaks(heatmaps: Float32Array, threshold: float) -> Peaks:
    """Cells above the threshold that no neighbour exceeds, at most `MOST_PEAKS` for each joint."""
    maps = heatmaps[:JOINT_COUNT]
    joint, row, column = np.nonzero(_local_maxima(maps) & (maps > threshold))
    height = maps[joint, row, column].astype(np.float64)
    order = np.lexsort((-height, joint))
    rank = np.arange(len(order)) - np.searchsorted(joint, joint)
    order = order[rank < MOST_PEAKS]
    joint, row, column = joint[order], row[order], column[order]
    position = np.stack([_refine(maps, joint, row, column, axis=2), _refine(maps, joint, row, column, axis=1)], axis=1)
    return Peaks(joint, position, height[order])


def group(peaks: Peaks, pafs: Float32Array) -> list[dict[Joint, int]]:
    """Skeletons, each as the index of a peak for every joint that it has; at least two joints each."""
    skeletons: list[dict[Joint, int]] = []
    limb_of, first, second, score = _supported_limbs(peaks, pafs)
    for limb, (joint_a, joint_b, _) in enumerate(LIMB_FIELDS):
        candidates = np.flatnonzero(limb_of == limb)
        for candidate in candidates[np.argsort(-score[candidates], kind="stable")]:
            _join(skeletons, joint_a, int(first[candidate]), joint_b, int(second[candidate]))
    return skeletons


def _local_maxima(maps: Float32Array) -> BoolArray:
    """Where no neighbour is higher; of a plateau only its first cell, row by row."""
    _, rows, columns = maps.shape
    padded = np.pad(maps, ((0, 0), (1, 1), (1, 1)), constant_values=-np.inf)
    highest = np.ones(maps.shape, dtype=bool)
    for down in range(3):
        for right in range(3):
            neighbour = padded[:, down : down + rows, right : right + columns]
            if (down, right) < (1, 1):
                highest &= maps > neighbour
            elif (down, right) > (1, 1):
                highest &= maps >= neighbour
    return highest


def _refine(
    maps: Float32Array, joint: NDArray[np.int64], row: NDArray[np.int64], column: NDArray[np.int64], *, axis: int
) -> Float64Array:
    """The summit, along one axis, of the parabola through a peak and its two neighbours; at the border, the cell."""
    centre = column if axis == 2 else row
    inner = (centre > 0) & (centre < maps.shape[axis] - 1)
    step = inner.astype(np.int64)
    down, right = (0, step) if axis == 2 else (step, 0)
    before, here, after = (
        maps[joint, row + sign * down, column + sign * right].astype(np.float64) for sign in (-1, 0, 1)
    )
    curvature = before - 2.0 * here + after
    offset = 0.5 * (before - after) / np.where(curvature < 0.0, curvature, -np.inf)
    return centre + np.clip(offset, -0.5, 0.5)


def _supported_limbs(
    peaks: Peaks, pafs: Float32Array
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Float64Array]:
    """All pairs of peaks that the fields support as a limb: limb, first peak, second peak and score."""
    limb, first, second = _possible_limbs(peaks)
    along = peaks.position[second] - peaks.position[first]
    length = np.linalg.norm(along, axis=1)
    direction = along / np.maximum(length, 1e-9)[:, None]
    samples = peaks.position[first][:, None] + along[:, None] * np.linspace(0.0, 1.0, SAMPLES)[:, None]
    columns, rows = np.rint(samples).astype(np.int64).transpose(2, 0, 1)
    channel = np.array([x_channel for _, _, x_channel in LIMB_FIELDS])[limb][:, None]
    alignment = pafs[channel, rows, columns] * direction[:, :1] + pafs[channel + 1, rows, columns] * direction[:, 1:]
    supported = ((alignment > LEAST_ALIGNMENT).mean(axis=1) >= LEAST_SUPPORT) & (length > 0.0)
    return limb[supported], first[supported], second[supported], alignment.mean(axis=1)[supported]


def _possible_limbs(peaks: Peaks) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Every pair of peaks of the two joints of every limb: limb, first peak, second peak."""
    of_joint = [np.flatnonzero(peaks.joint == joint) for joint in Joint]
    pairs = [
        (np.full(len(of_joint[a]) * len(of_joint[b]), limb), *map(np.ravel, np.meshgrid(of_joint[a], of_joint[b])))
        for limb, (a, b, _) in enumerate(LIMB_FIELDS)
    ]
    limb, first, second = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    return limb, first, second


def _join(skeletons: list[dict[Joint, int]], joint_a: Joint, a: int, joint_b: Joint, b: int) -> None:
    """Add a limb to the skeletons: it starts one, lengthens one or makes two into one.

    A skeleton keeps the joint that it has: a limb of a higher score came before.
    """
    with_a = next((skeleton for skeleton in skeletons if skeleton.get(joint_a) == a), None)
    with_b = next((skeleton for skeleton in skeletons if skeleton.get(joint_b) == b), None)
    if with_a is None and with_b is None:
        skeletons.append({joint_a: a, joint_b: b})
    elif with_b is None and with_a is not None:
        with_a.setdefault(joint_b, b)
    elif with_a is None and with_b is not None:
        with_b.setdefault(joint_a, a)
    elif with_a is not with_b and with_a is not None and with_b is not None and with_a.keys().isdisjoint(with_b):
        with_a.update(with_b)
        skeletons.remove(with_b)
