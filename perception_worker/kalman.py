"""Kalman filter over 18 joints at rest (thesis, section 3.3.4).

The state travels: `FilterState` goes out with a request and comes back updated, so any worker can take the next frame.
Transition and observation matrices are diagonal of ones and zeros, so the covariance stays diagonal for ever and each
coordinate is a filter of its own. The state's rule says where an observation's noise comes from: the thesis takes
1 - quality for m²; ours is a learned lifter's variance, made larger, since a lifter's error of a person repeats in the
next frame (docs/qoe.md).
"""

import numpy as np

from protocol.arrays import BoolArray, Float64Array
from protocol.joint_arrays import FARTHEST, MOST_VARIANCE
from protocol.pose_estimate import BASE_PROCESS_NOISES, FilterRule, FilterState

PROCESS_NOISE_GROWTH: dict[FilterRule, float] = {"quality": 0.001, "variance": 0.001}
"""m² added to a joint's process noise by each frame that doesn't locate it."""

LEAST_OBSERVATION_NOISE = 1e-4
"""m². However good the quality, a depth camera does not measure more exactly than to a centimetre."""

REPEATED = 2.0
"""By how much a lifter's variance counts more, since frames that follow each other share their errors."""


def update(
    filter_state: FilterState, points: Float64Array, quality: Float64Array, variance: Float64Array | None = None
) -> FilterState:
    """The filter after one more frame.

    Args:
        filter_state: the filter before it.
        points: (18, 3) world frame, metres, NaN where a joint is not located.
        quality: (18,) combined quality in [0, 1].
        variance: (18, 3) m² of the points along the world's axes, where they are known.

    Source: thesis, section 3.3.4; open points as decided in docs/qoe.md.
    """
    if filter_state.rule == "variance" and variance is not None:
        return _updated(filter_state, points, np.maximum(REPEATED * variance, LEAST_OBSERVATION_NOISE))
    return _updated(filter_state, points, np.maximum(1.0 - quality, LEAST_OBSERVATION_NOISE)[:, None])


def _updated(filter_state: FilterState, points: Float64Array, noise: Float64Array) -> FilterState:
    # A comparison with NaN is false. A point beyond all distances counts as not located.
    located = np.all(np.abs(points) <= FARTHEST, axis=1)
    predicted = _predicted_variance(filter_state)
    gain = np.where(located[:, None], predicted / (predicted + noise), 0.0)
    innovation = np.where(located[:, None], points, filter_state.mean) - filter_state.mean
    return FilterState(
        mean=filter_state.mean + gain * innovation,
        variance=(1.0 - gain) * predicted,
        process_noise=_process_noise(filter_state, located),
        seen=filter_state.seen | located,
        rule=filter_state.rule,
    )


def _predicted_variance(filter_state: FilterState) -> Float64Array:
    # A joint has its initial variance until it is first seen: nothing is known of it that could be forgotten.
    predicted = filter_state.variance + np.where(filter_state.seen, filter_state.process_noise, 0.0)[:, None]
    # A filter that is at its bounds must not grow out of them: its next state could not travel.
    return np.minimum(predicted, MOST_VARIANCE)


def _process_noise(filter_state: FilterState, located: BoolArray) -> Float64Array:
    """(18,) m² a frame: the rule's where a joint is located, and growing where a joint seen before is not."""
    grown = np.minimum(filter_state.process_noise + PROCESS_NOISE_GROWTH[filter_state.rule], MOST_VARIANCE)
    forgotten = np.where(filter_state.seen, grown, filter_state.process_noise)
    return np.where(located, BASE_PROCESS_NOISES[filter_state.rule], forgotten)
