"""From the network's maps to people's keypoints.

Peaks of the heatmaps are the candidates for each joint; the part-affinity fields tell which candidates belong to the
same limb; limbs that share a candidate make a skeleton. The person is the skeleton with the most keypoints.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception_worker.networks.network import NetworkOutput, People
from protocol.arrays import Float32Array, Float64Array
from protocol.skeleton import JOINT_COUNT, Joint

MOST_PEAKS = 16
"""Candidates for one joint; lower peaks are left out, so that noise can't make decoding slow."""

SAMPLES = 10
"""Places along a limb where the field is sampled."""

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


_FIRST, _SECOND, _CHANNEL = np.array(LIMB_FIELDS).T
_ALONG = np.linspace(0.0, 1.0, SAMPLES)[:, None]


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


def decode(output: NetworkOutput, threshold: float) -> People:
    """The keypoints of the person who shows the most of them; between equals, of the higher peaks; and of the others.

    Args:
        output: the network's maps, all of them finite.
        threshold: height that a peak must exceed.
    """
    peaks = find_peaks(output.heatmaps, threshold)
    skeletons = [(list(skeleton), list(skeleton.values())) for skeleton in group(peaks, output.pafs)]
    skeletons.sort(key=lambda skeleton: (len(skeleton[0]), peaks.height[skeleton[1]].sum()), reverse=True)
    keypoints = np.full((max(len(skeletons), 1), JOINT_COUNT, 2), np.nan)
    for own, (joints, chosen) in zip(keypoints, skeletons, strict=False):
        own[joints] = peaks.position[chosen]
    return People(keypoints[0], keypoints[1:])


def find_peaks(heatmaps: Float32Array, threshold: float) -> Peaks:
    """Cells above the threshold that no neighbour exceeds, at most `MOST_PEAKS` for each joint."""
    maps = heatmaps[:JOINT_COUNT]
    count, rows, columns = maps.shape
    # A border of its own around each map, so that the neighbours of every cell are where those of any other are.
    bordered = np.full((count, rows + 2, columns + 2), -np.inf, maps.dtype)
    bordered[:, 1:-1, 1:-1] = maps
    values, width = bordered.reshape(-1), columns + 2
    cells = _local_maxima(values, np.flatnonzero(values > threshold), width)
    joint = cells // ((rows + 2) * width)
    height = values[cells].astype(np.float64)
    order = np.lexsort((-height, joint))
    rank = np.arange(len(order)) - np.searchsorted(joint, joint)
    order = order[rank < MOST_PEAKS]
    cells, joint = cells[order], joint[order]
    row, column = np.divmod(cells - joint * ((rows + 2) * width), width)
    position = np.stack([column, row], axis=1) - 1 + _offsets(values, cells, width)
    return Peaks(joint, position, height[order])


def group(peaks: Peaks, pafs: Float32Array) -> list[dict[int, int]]:
    """Skeletons, each as the index of a peak for every joint that it has; at least two joints each."""
    skeletons: list[dict[int, int]] = []
    owner: dict[int, dict[int, int]] = {}
    limb, first, second, score = _supported_limbs(peaks, pafs)
    # Limb after limb, of each the best supported pair first.
    order = np.lexsort((-score, limb))
    ends = zip(*(values[order].tolist() for values in (_FIRST[limb], first, _SECOND[limb], second)), strict=True)
    for joint_a, a, joint_b, b in ends:
        _join(skeletons, owner, joint_a, a, joint_b, b)
    return skeletons


def _local_maxima(values: Float32Array, cells: NDArray[np.int64], width: int) -> NDArray[np.int64]:
    """The cells that no neighbour exceeds; of a plateau only its first cell, row by row."""
    here = values[cells][:, None]
    before = np.array([-width - 1, -width, -width + 1, -1])
    highest = (here > values[cells[:, None] + before]) & (here >= values[cells[:, None] - before])
    return cells[highest.all(axis=1)]


def _offsets(values: Float32Array, cells: NDArray[np.int64], width: int) -> Float64Array:
    """(n, 2) from a cell to the summit, along columns and rows, of the parabola through it and its two neighbours.

    A cell at the border has none in that direction.
    """
    step = np.array([1, width])
    before, after = (values[cells[:, None] + sign * step].astype(np.float64) for sign in (-1, 1))
    curvature = before - 2.0 * values[cells].astype(np.float64)[:, None] + after
    curved = (curvature < 0.0) & (curvature > -np.inf)
    slope = np.subtract(before, after, out=np.zeros_like(curvature), where=curved)
    offset = 0.5 * slope / np.where(curved, curvature, -1.0)
    return np.minimum(np.maximum(offset, -0.5), 0.5)


def _supported_limbs(
    peaks: Peaks, pafs: Float32Array
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Float64Array]:
    """All pairs of peaks that the fields support as a limb: limb, first peak, second peak and score."""
    limb, first, second = _possible_limbs(peaks)
    start = peaks.position[first]
    along = peaks.position[second] - start
    length = np.sqrt((along * along).sum(axis=1))
    direction = along / np.maximum(length, 1e-9)[:, None]
    columns, rows = np.rint(start[:, None] + along[:, None] * _ALONG).astype(np.int64).transpose(2, 0, 1)
    channel = _CHANNEL[limb][:, None]
    alignment = pafs[channel, rows, columns] * direction[:, :1] + pafs[channel + 1, rows, columns] * direction[:, 1:]
    support = (alignment > LEAST_ALIGNMENT).sum(axis=1) / SAMPLES
    supported = np.flatnonzero((support >= LEAST_SUPPORT) & (length > 0.0))
    return limb[supported], first[supported], second[supported], alignment[supported].mean(axis=1)


def _possible_limbs(peaks: Peaks) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Every pair of peaks of the two joints of every limb: limb, first peak, second peak."""
    counts = np.bincount(peaks.joint, minlength=JOINT_COUNT)
    begins = np.cumsum(counts) - counts
    pairs = counts[_FIRST] * counts[_SECOND]
    limb = np.repeat(np.arange(len(LIMB_FIELDS)), pairs)
    nth = np.arange(len(limb)) - (np.cumsum(pairs) - pairs)[limb]
    of_second, of_first = np.divmod(nth, counts[_FIRST][limb])
    return limb, begins[_FIRST][limb] + of_first, begins[_SECOND][limb] + of_second


def _join(
    skeletons: list[dict[int, int]], owner: dict[int, dict[int, int]], joint_a: int, a: int, joint_b: int, b: int
) -> None:
    """Add a limb to the skeletons: it starts one, lengthens one or makes two into one.

    A skeleton keeps the joint that it has: a limb of a higher score came before.
    """
    with_a, with_b = owner.get(a), owner.get(b)
    if with_a is None and with_b is None:
        owner[a] = owner[b] = {joint_a: a, joint_b: b}
        skeletons.append(owner[a])
    elif with_b is None and with_a is not None:
        _lengthen(with_a, owner, joint_b, b)
    elif with_a is None and with_b is not None:
        _lengthen(with_b, owner, joint_a, a)
    elif with_a is not with_b and with_a is not None and with_b is not None and with_a.keys().isdisjoint(with_b):
        with_a.update(with_b)
        owner.update(dict.fromkeys(with_b.values(), with_a))
        skeletons.remove(with_b)


def _lengthen(skeleton: dict[int, int], owner: dict[int, dict[int, int]], joint: int, peak: int) -> None:
    if joint not in skeleton:
        skeleton[joint] = peak
        owner[peak] = skeleton
