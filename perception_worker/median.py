"""The median of few values."""

import numpy as np

from protocol.arrays import Float64Array


def median(values: Float64Array) -> Float64Array:
    """`numpy.median` along the first axis, which takes several times as long over so few values.

    Args:
        values: (n, …), one at least, none of them NaN.

    Returns:
        (…), the mean of the middle two where n is even.
    """
    rising = np.sort(values, axis=0)
    return (rising[(len(rising) - 1) // 2] + rising[len(rising) // 2]) / 2
