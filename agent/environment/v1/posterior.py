"""How far a filter's joints may be from the true ones, in metres.

A joint's posterior is a normal distribution with a variance along each axis. The square of its distance from the mean
is a weighted sum of three chi-squares of one degree; it is taken for one scaled chi-square with the same mean and
variance (Satterthwaite 1946), of one degree for a joint that is uncertain along one axis alone, of three for one that
is equally uncertain along all. Expected distances are within 1%, radii within 1.5%, of the exact ones at both ends.
"""

import numpy as np

from protocol.arrays import Float64Array
from protocol.skeleton import upper_body_weights

_NINETY = 1.2815515655446004
"""Standard deviations of a normal distribution below which it lies with probability 0.9."""

_LEAST_VARIANCE = 1e-12
"""m²; a variance of zero has no degrees of freedom."""


def expected_errors(variance: Float64Array) -> Float64Array:
    """(…,) expected distance between mean and joint, metres, for variances (…, 3) in m²."""
    scale, degrees = _chi_square(variance)
    # The mean of a chi distribution, by its asymptotic series.
    return np.sqrt(scale * (degrees - 0.5 + 1.0 / (8.0 * degrees)))


def radii(variance: Float64Array) -> Float64Array:
    """(…,) radius around the mean that holds the joint with probability 0.9, metres, for variances (…, 3) in m².

    Source: Wilson and Hilferty 1931, for the chi-square's quantile.
    """
    scale, degrees = _chi_square(variance)
    spread = 2.0 / (9.0 * degrees)
    return np.sqrt(scale * degrees * (1.0 - spread + _NINETY * np.sqrt(spread)) ** 3)


def over_upper_body(lengths: Float64Array) -> float:
    """The mean of lengths (18,) in metres by the weights of the thesis's section 4.3.5."""
    weights = upper_body_weights()
    return float(weights @ lengths / weights.sum())


def _chi_square(variance: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Scale, m², and degrees of freedom, 1 to 3, of the squared distance."""
    kept = np.maximum(variance, _LEAST_VARIANCE)
    total, squares = kept.sum(axis=-1), (kept**2).sum(axis=-1)
    return squares / total, total**2 / squares
