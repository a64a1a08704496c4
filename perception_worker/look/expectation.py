"""Where in a picture a person is expected, and whose skeleton there is theirs."""

from dataclasses import dataclass

import numpy as np

from perception_worker.lifting import BODY_REACH
from perception_worker.look.region import around_person
from perception_worker.median import median
from perception_worker.networks.network import People
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import Camera, project
from protocol.pose_estimate import FilterState
from protocol.region import Region
from protocol.skeleton import JOINT_COUNT

LEAST_JOINTS = 3
"""Joints that make somebody: fewer are nobody to look closer at, or somebody lost."""

_MOST_DEVIATION = 1.0
"""Metres. Of a joint that is less sure than that, the filter knows no more than before it saw it."""

_NEAREST = 0.2
"""Metres in front of the camera, from which on a joint has a place in the picture."""

_MARGIN_DEVIATIONS = 0.5
"""By how many of the filter's deviations the region is wider. They are of qualities taken for m², which err on the wide
side (docs/results.md)."""

_SUPPOSED_DEVIATIONS = 1.0
"""Likewise, of a filter that has yet to see somebody; what it starts with is a deviation indeed."""

_GATE = 0.4
"""Metres that a joint may lie from where it is expected, besides the filter's deviation."""

_GATE_OF_SIZE = 0.25
"""Of a person's size in the picture: what two looks at the same joint may differ by."""

_GATE_OF_CELL = 1.5
"""Cells of the first look's heatmaps, likewise."""


@dataclass(frozen=True, eq=False)
class Expectation:
    """Somebody who is expected in a picture.

    Attributes:
        pixels: (18, 2) x and y of each joint, NaN where it is not known.
        reach: pixels by which the region is wider, since the joints may be off.
        gate: pixels from there, beyond which a joint is somebody else's.
    """

    pixels: Float64Array
    reach: float
    gate: float

    def region(self, area: Region, aspect: float) -> Region | None:
        """The part of the picture to look at; None where it has to be all of it."""
        if _count(self.pixels) < LEAST_JOINTS:
            return None
        return around_person(self.pixels, area, aspect, reach=self.reach)

    def choose(self, people: People, keypoints: Float64Array) -> People:
        """Of all people in a picture the one who is expected, and everybody else.

        Who shows the most joints the nearest to where they are expected is the one; nobody, where at the median of the
        joints that both have nobody is within the gate.

        Args:
            people: in cells of the heatmaps.
            keypoints: (1 + n, 18, 2) of the same people, the person first, in pixels of the whole picture.
        """
        everybody = np.concatenate([people.person[None], people.others])
        away = np.linalg.norm(keypoints - self.pixels, axis=2)
        nearness = np.nansum(np.maximum(1.0 - away / self.gate, 0.0), axis=1)
        own = int(np.argmax(nearness))
        both = np.isfinite(away[own])
        if not both.any() or median(away[own][both]) > self.gate:
            return People(np.full_like(people.person, np.nan), everybody[np.isfinite(everybody).any(axis=(1, 2))])
        return People(everybody[own], np.delete(everybody, own, axis=0))


def expected_by(state: FilterState, camera: Camera) -> Expectation | None:
    """Whom a filter expects in a camera's picture; None where it knows nobody yet, or nobody any more."""
    known = state.seen & (_deviation(state) <= _MOST_DEVIATION)
    if known.sum() < LEAST_JOINTS:
        return None
    middle = median(state.mean[known])
    # A joint that the filter has beyond was seen wrong.
    known &= np.linalg.norm(state.mean - middle, axis=1) <= BODY_REACH
    if known.sum() < LEAST_JOINTS:
        return None
    return _placed(state, camera, known, _MARGIN_DEVIATIONS)


def supposed_by(state: FilterState, camera: Camera) -> Expectation:
    """Who may be in a camera's picture of somebody whom the filter does not know: whoever is where it begins to look.

    That is at its means, give or take its deviations. Of a person who was lost, it is where they were.
    """
    return _placed(state, camera, np.ones(JOINT_COUNT, bool), _SUPPOSED_DEVIATIONS)


def _placed(state: FilterState, camera: Camera, joints: BoolArray, margin: float) -> Expectation:
    """Somebody of whom the filter tells some joints (18,), the region wider by `margin` of its deviations."""
    placed = project(state.mean, camera)
    in_front = joints & (placed[:, 2] >= _NEAREST)
    pixels = np.where(in_front[:, None], placed[:, :2], np.nan)
    if not in_front.any():
        return Expectation(pixels, reach=0.0, gate=1.0)
    a_metre = camera.intrinsics.fx / float(median(placed[in_front, 2]))
    unsure = float(median(_deviation(state)[in_front]))
    return Expectation(pixels, reach=margin * unsure * a_metre, gate=(_GATE + unsure) * a_metre)


def expected_at(keypoints: Float64Array, cell: float) -> Expectation:
    """Whom a look has just found, expected at the same place by the next look at the same picture.

    Args:
        keypoints: (18, 2) pixels x and y, NaN where there is none; two at least are found.
        cell: pixels of a cell of that look's heatmaps.
    """
    size = np.nanmax(keypoints, axis=0) - np.nanmin(keypoints, axis=0)
    return Expectation(keypoints, reach=0.0, gate=max(_GATE_OF_SIZE * float(size.max()), _GATE_OF_CELL * cell))


def _deviation(state: FilterState) -> Float64Array:
    """(18,) metres that each joint is thought to be off."""
    return np.sqrt((state.variance + state.process_noise[:, None]).mean(axis=1))


def _count(pixels: Float64Array) -> int:
    return int(np.isfinite(pixels[:, 0]).sum())
