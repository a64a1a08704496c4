"""Split conformal prediction: the bound of a score that holds on people who were not fitted on."""

import math

import numpy as np

from protocol.arrays import Float64Array
from protocol.errors import InvalidInput

COVERAGE = 0.9
"""The share of joints that their radius is to hold."""


def conformal_quantile(scores: Float64Array, coverage: float = COVERAGE) -> float:
    """The score that one more, of the same kind, stays below with probability `coverage`.

    Raises:
        InvalidInput: there are too few scores.
    """
    rank = math.ceil((len(scores) + 1) * coverage)
    if rank > len(scores):
        raise InvalidInput(f"{len(scores)} joints of a kind are too few to calibrate by")
    return float(np.partition(scores, rank - 1)[rank - 1])
