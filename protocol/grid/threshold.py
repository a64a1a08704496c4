"""When a view on the grid is good enough: the weighted uncertainty of each cell, and the threshold by rule."""

import numpy as np

from protocol.arrays import Float64Array
from protocol.errors import InvalidInput
from protocol.grid.table import CENTRE, GridTable
from protocol.skeleton import upper_body_weights

THESIS_THRESHOLD = 1.1
"""Source: thesis, section 4.3.5."""

THRESHOLDS_A_UNIT = 20
"""Thresholds are multiples of 0.05, the step of the thesis's curriculum (section 4.4)."""

SOLVABLE_SHARE = 0.95
"""Share of the train environments that have a successful cell at the threshold by rule."""


def weighted_uncertainties(table: GridTable) -> Float64Array:
    """(n, 361) weighted uncertainty of the upper body in each cell, from 0 to 10; 10 in the centre, which has no view.

    Source: thesis, section 4.3.5.
    """
    weighted = table.uncertainties().astype(np.float64) @ upper_body_weights()
    weighted[:, CENTRE] = upper_body_weights().sum()
    return weighted


def best_uncertainties(weighted: Float64Array) -> Float64Array:
    """(n,) the lowest weighted uncertainty of each environment; the centre does not count.

    Args:
        weighted: (n, 361) as `weighted_uncertainties`.
    """
    return np.delete(weighted, CENTRE, axis=1).min(axis=1)


def ceiling(weighted: Float64Array, threshold: float) -> float:
    """The share of environments that have a cell below a threshold: no policy's success rate is higher.

    Args:
        weighted: (n, 361), of one environment or more.
    """
    return float(np.mean(best_uncertainties(weighted) < threshold))


def threshold_by_rule(weighted: Float64Array) -> float:
    """The lowest multiple of 0.05 at which at least 95% of the environments have a cell below it.

    Args:
        weighted: (n, 361) of the train environments.

    Raises:
        InvalidInput: there is no such threshold, since more than 5% of the environments show no person.
    """
    thresholds = np.arange(1, 10 * THRESHOLDS_A_UNIT + 1) / THRESHOLDS_A_UNIT
    shares = (best_uncertainties(weighted)[:, None] < thresholds).mean(axis=0)
    reached = np.flatnonzero(shares >= SOLVABLE_SHARE)
    if not reached.size:
        raise InvalidInput(
            f"only {shares[-1]:.0%} of the train environments have a cell from which the person is found at all, "
            f"and the threshold is where {SOLVABLE_SHARE:.0%} have one that succeeds; set grid.success_threshold"
        )
    return float(thresholds[reached[0]])
