"""95% confidence intervals."""

import math
from collections.abc import Sequence

import numpy as np

from protocol.records import Interval

_QUANTILE = 1.959963984540054
"""Of the standard normal distribution, for 95% between minus and plus it."""

_RESAMPLES = 10_000


def mean_interval(values: Sequence[float], seed: int = 0) -> Interval:
    """The mean of one or more values, its interval by the percentile bootstrap; the same values give the same one."""
    sample = np.asarray(values, float)
    drawn = np.random.default_rng(seed).integers(len(sample), size=(_RESAMPLES, len(sample)))
    low, high = np.quantile(sample[drawn].mean(axis=1), (0.025, 0.975))
    return Interval(mean=float(sample.mean()), low=float(low), high=float(high))


def rate_interval(successes: int, trials: int) -> Interval:
    """A rate and Wilson's score interval, which holds for few trials and for rates near 0 and 1."""
    rate = successes / trials
    spread = _QUANTILE**2 / trials
    middle = (rate + spread / 2) / (1 + spread)
    half = _QUANTILE / (1 + spread) * math.sqrt(rate * (1 - rate) / trials + spread / (4 * trials))
    return Interval(mean=rate, low=max(0.0, middle - half), high=min(1.0, middle + half))
