"""95% intervals by the bootstrap over people.

Frames of one person resemble each other, so people are drawn again and not frames. A figure is computed for many
samples at once: each is told by how often every person is in it, and what a person adds to a sum is summed up once.
"""

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from protocol.arrays import AnyArray, BoolArray, Float64Array
from protocol.errors import InvalidInput

RESAMPLES = 1000
_SEED = 0xB007
_BLOCK = 50
"""Samples at once where each needs memory for every value."""

IntArray = NDArray[np.int64]


class Figure(Struct, frozen=True):
    """A figure and its 95% interval; NaN where there is too little to compute it from."""

    value: float
    low: float
    high: float


def people_of(identities: AnyArray) -> IntArray:
    """(n,) the people by numbers from 0 on."""
    return np.unique(identities, return_inverse=True)[1].astype(np.int64)


def samples_of_people(people: int, resamples: int = RESAMPLES) -> IntArray:
    """(1 + resamples, people) how often each person is in each sample; in the first, each person is once."""
    if people < 1:
        raise InvalidInput("there are no people to compute figures of")
    drawn = np.random.default_rng(_SEED).multinomial(people, np.full(people, 1 / people), size=resamples)
    return np.concatenate([np.ones((1, people), np.int64), drawn])


def figure(statistic: Float64Array) -> Figure:
    """The first sample's statistic, its interval by the percentiles of the others, those that have none left out."""
    value, others = float(statistic[0]), statistic[1:][np.isfinite(statistic[1:])]
    if not np.isfinite(value) or len(others) == 0:
        return Figure(value, np.nan, np.nan)
    low, high = np.quantile(others, (0.025, 0.975))
    return Figure(value, float(low), float(high))


def mean(values: Float64Array | BoolArray, person: IntArray, samples: IntArray) -> Float64Array:
    """The mean of values (n,) in each sample; NaN in one without any."""
    people = samples.shape[1]
    total = samples @ np.bincount(person, np.asarray(values, float), people)
    count = samples @ np.bincount(person, minlength=people)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def quantile(values: Float64Array, share: float, person: IntArray, samples: IntArray) -> Float64Array:
    """The smallest value that at least `share` of the values are not above, in each sample; NaN in one without any."""
    order = np.argsort(values, kind="stable")
    found = np.full(len(samples), np.nan)
    if len(order) == 0:
        return found
    rising, owner = np.asarray(values, float)[order], person[order]
    for begin in range(0, len(samples), _BLOCK):
        reached = np.cumsum(samples[begin : begin + _BLOCK, owner], axis=1)
        needed = share * reached[:, -1:]
        first = np.argmax(reached >= np.maximum(needed, 1), axis=1)
        found[begin : begin + _BLOCK] = np.where(reached[:, -1] > 0, rising[first], np.nan)
    return found
