"""Choices that nothing was learned for, or little."""

from collections.abc import Iterator, Sequence

import numpy as np

from perception_worker.next_view.arrays import AROUND, CENTRE, Arrays
from perception_worker.next_view.choices import Choices
from perception_worker.next_view.classifiers import ABOVE, BELOW, LEFT, RIGHT
from perception_worker.next_view.people import person_frame
from protocol.arrays import Float64Array

DIRECTIONS = ("up left", "up", "up right", "left", "right", "down left", "down", "down right")
"""The cameras around the centre, in order."""


def baselines(arrays: Arrays, lifted: Float64Array, seeds: Sequence[int]) -> Iterator[Choices]:
    """All of them.

    Args:
        lifted: (n, 9, 18, 3) the joints as a lifter has them from each view.
    """
    for seed in seeds:
        expected = np.random.default_rng(seed).random((len(arrays), len(AROUND)))
        yield Choices(group="baseline", method="random", seed=seed, expected=expected)
    yield _named(arrays, "the best most often in training", _most_often_best(arrays))
    yield _named(arrays, "the lowest on average in training", _lowest_on_average(arrays))
    facing = {
        "towards the front, as estimated": person_frame(lifted[:, CENTRE], arrays.person).yaw,
        "towards the front, as it is": arrays.yaw,
    }
    for name, yaw in facing.items():
        yield _named(arrays, name, towards_front(arrays, yaw))
    yield _named(arrays, "the better of left and right, both visited", best_visited(arrays, (LEFT, RIGHT)))
    around = best_visited(arrays, (LEFT, RIGHT, ABOVE, BELOW))
    yield _named(arrays, "the best of left, right, up and down, all visited", around)


def towards_front(arrays: Arrays, yaw: Float64Array) -> Float64Array:
    """(n, 8) 0 for the camera beside the centre that is nearer to a person's front, who faces along `yaw`; else 1."""
    offset = arrays.position[:, :, :2] - arrays.person[:, None]
    angle = np.arctan2(offset[:, :, 1], offset[:, :, 0]) - yaw[:, None]
    nearness = np.cos(angle)
    chosen = np.where(nearness[:, LEFT] > nearness[:, RIGHT], LEFT, RIGHT)
    return (chosen[:, None] != AROUND).astype(float)


def best_visited(arrays: Arrays, visited: Sequence[int]) -> Float64Array:
    """(n, 8) the uncertainty of the cameras that were visited, and infinite elsewhere."""
    return np.where(np.isin(AROUND, visited), arrays.uncertainty[:, AROUND], np.inf)


def _most_often_best(arrays: Arrays) -> Float64Array:
    best = arrays.uncertainty[arrays.is_train][:, AROUND].argmin(axis=1)
    return -np.bincount(best, minlength=len(AROUND)).astype(float)


def _lowest_on_average(arrays: Arrays) -> Float64Array:
    return arrays.uncertainty[arrays.is_train][:, AROUND].mean(axis=0)


def _named(arrays: Arrays, name: str, expected: Float64Array) -> Choices:
    """A way without a seed; (8,) for all scenes alike, or (n, 8)."""
    everywhere = np.broadcast_to(expected, (len(arrays), len(AROUND)))
    return Choices(group="baseline", method=name, seed=0, expected=everywhere)
