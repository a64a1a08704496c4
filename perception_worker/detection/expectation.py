"""Where in a picture a person is expected, and which skeleton there is the person's."""

from dataclasses import dataclass

import numpy as np

from perception_worker.detection.region import around_person
from perception_worker.lifting import BODY_REACH
from perception_worker.median import median
from perception_worker.networks.network import People
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import Camera, project
from protocol.pose_estimate import FilterState
from protocol.region import Region
from protocol.skeleton import JOINT_COUNT

LEAST_JOINTS = 3
"""Joints that make a person: with fewer there is none to detect closer, or a known one is lost."""

_MOST_DEVIATION = 1.0
"""Metres. A joint that is less sure than that counts as not known to the filter."""

_NEAREST = 0.2
"""Metres in front of the camera. A joint nearer than that has no place in the picture."""

_MARGIN_DEVIATIONS = 0.5
"""By how many of the filter's deviations the region is wider. A deviation stems from a quality taken for m², which errs
on the wide side (docs/results.md)."""

_SUPPOSED_DEVIATIONS = 1.0
"""Likewise, of a filter that has seen no person yet; its initial variance is a true one."""

_GATE = 0.4
"""Metres that a joint may lie from where it is expected, besides the filter's deviation."""

_GATE_OF_SIZE = 0.25
"""Of a person's size in the picture: by how much two detections of the same joint may differ."""

_GATE_OF_CELL = 1.5
"""Cells of the first detection's heatmaps, likewise."""


@dataclass(frozen=True, eq=False)
class Expectation:
    """A person expected in a picture.

    Attributes:
        pixels: (18, 2) x and y of each joint, NaN where it is not known.
        reach: pixels by which the region is wider, since the joints may be off.
        gate: pixels from there, beyond which a joint is another person's.
    """

    pixels: Float64Array
    reach: float
    gate: float

    def region(self, area: Region, aspect: float) -> Region | None:
        """The part of the picture to show the network; None where it has to be all of it."""
        if _count(self.pixels) < LEAST_JOINTS:
            return None
        return around_person(self.pixels, area, aspect, reach=self.reach)

    def choose(self, people: People, keypoints: Float64Array) -> People:
        """Of all people in a picture the one who is expected, and the others.

        The expected person is the one with the most joints nearest to where they are expected. If that one's joints
        are at their median outside the gate, the expected person is not in the picture.

        Args:
            people: in cells of the heatmaps.
            keypoints: (1 + n, 18, 2) of the same people, the person first, in pixels of the whole picture.
        """
        candidates = np.concatenate([people.person[None], people.others])
        away = np.linalg.norm(keypoints - self.pixels, axis=2)
        nearness = np.nansum(np.maximum(1.0 - away / self.gate, 0.0), axis=1)
        own = int(np.argmax(nearness))
        both = np.isfinite(away[own])
        if not both.any() or median(away[own][both]) > self.gate:
            return People(np.full_like(people.person, np.nan), candidates[np.isfinite(candidates).any(axis=(1, 2))])
        return People(candidates[own], np.delete(candidates, own, axis=0))


def expected_by(filter_state: FilterState, camera: Camera) -> Expectation | None:
    """The person whom a filter expects in a camera's picture; None where it knows none yet, or none any more."""
    known = filter_state.seen & (_deviation(filter_state) <= _MOST_DEVIATION)
    if known.sum() < LEAST_JOINTS:
        return None
    middle = median(filter_state.mean[known])
    # A joint farther away than that was located wrong.
    known &= np.linalg.norm(filter_state.mean - middle, axis=1) <= BODY_REACH
    if known.sum() < LEAST_JOINTS:
        return None
    return _placed(filter_state, camera, known, _MARGIN_DEVIATIONS)


def supposed_by(filter_state: FilterState, camera: Camera) -> Expectation:
    """The person supposed in a camera's picture where the filter knows none: at its means, within its deviations.

    For a person who was lost, that is where they were.
    """
    return _placed(filter_state, camera, np.ones(JOINT_COUNT, bool), _SUPPOSED_DEVIATIONS)


def _placed(filter_state: FilterState, camera: Camera, joints: BoolArray, margin: float) -> Expectation:
    """A person of whom the filter knows some joints (18,), the region wider by `margin` of its deviations."""
    placed = project(filter_state.mean, camera)
    in_front = joints & (placed[:, 2] >= _NEAREST)
    pixels = np.where(in_front[:, None], placed[:, :2], np.nan)
    if not in_front.any():
        return Expectation(pixels, reach=0.0, gate=1.0)
    a_metre = camera.intrinsics.fx / float(median(placed[in_front, 2]))
    unsure = float(median(_deviation(filter_state)[in_front]))
    return Expectation(pixels, reach=margin * unsure * a_metre, gate=(_GATE + unsure) * a_metre)


def expected_at(keypoints: Float64Array, cell: float) -> Expectation:
    """A person just detected, expected at the same place by the next detection in the same picture.

    Args:
        keypoints: (18, 2) pixels x and y, NaN where there is none; two at least are found.
        cell: pixels of a cell of that detection's heatmaps.
    """
    size = np.nanmax(keypoints, axis=0) - np.nanmin(keypoints, axis=0)
    return Expectation(keypoints, reach=0.0, gate=max(_GATE_OF_SIZE * float(size.max()), _GATE_OF_CELL * cell))


def _deviation(filter_state: FilterState) -> Float64Array:
    """(18,) metres that each joint may be off by the filter's variance."""
    return np.sqrt((filter_state.variance + filter_state.process_noise[:, None]).mean(axis=1))


def _count(pixels: Float64Array) -> int:
    return int(np.isfinite(pixels[:, 0]).sum())
