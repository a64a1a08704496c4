"""Kalman filter over 18 joints at rest (thesis, section 3.3.4).

The state travels: `FilterState` goes out with a request and comes back updated, so any worker can take the next frame.
Transition and observation matrices are diagonal of ones and zeros, so the covariance stays diagonal for ever and each
coordinate is a filter of its own. What an observation's noise is, the state's rule says: the thesis's takes 1 - quality
for m²; ours is a learned lifter's variance, made larger, since what a lifter gets wrong of somebody it gets wrong in
the next frame as well (docs/qoe.md).
"""

import numpy as np

from protocol.arrays import Float64Array
from protocol.joint_arrays import FARTHEST, MOST_VARIANCE
from protocol.pose_estimate import BASE_PROCESS_NOISES, FilterRule, FilterState

PROCESS_NOISE_GROWTH: dict[FilterRule, float] = {"quality": 0.001, "variance": 0.001}
"""m² added to a joint's process noise by each frame that doesn't locate it."""

LEAST_OBSERVATION_NOISE = 1e-4
"""m². However good the quality, a depth camera does not measure more exactly than to a centimetre."""

REPEATED = 2.0
"""By how much a lifter's variance counts more, since frames that follow each other share their errors."""


def update(
    state: FilterState, points: Float64Array, quality: Float64Array, variance: Float64Array | None = None
) -> FilterState:
    """The filter after one more frame.

    Args:
        state: the filter before it.
        points: (18, 3) world frame, metres, NaN where a joint is not located.
        quality: (18,) combined quality in [0, 1].
        variance: (18, 3) m² of the points along the world's axes, where they are known.

    Source: thesis, section 3.3.4; open points as decided in docs/qoe.md.
    """
    if state.rule == "variance" and variance is not None:
        return _updated(state, points, np.maximum(REPEATED * variance, LEAST_OBSERVATION_NOISE))
    return _updated(state, points, np.maximum(1.0 - quality, LEAST_OBSERVATION_NOISE)[:, None])


def _updated(state: FilterState, points: Float64Array, noise: Float64Array) -> FilterState:
    # A comparison with NaN is false. What is beyond all distances is nowhere.
    located = np.all(np.abs(points) <= FARTHEST, axis=1)
    # A joint has its initial variance until it is first seen: nothing is known of it that could be forgotten.
    predicted = state.variance + np.where(state.seen, state.process_noise, 0.0)[:, None]
    # A filter that is at its bounds must not grow out of them: its next state could not travel.
    predicted = np.minimum(predicted, MOST_VARIANCE)
    gain = np.where(located[:, None], predicted / (predicted + noise), 0.0)
    innovation = np.where(located[:, None], points, state.mean) - state.mean
    growth = PROCESS_NOISE_GROWTH[state.rule]
    grown = np.minimum(state.process_noise + growth, MOST_VARIANCE)
    forgotten = np.where(state.seen, grown, state.process_noise)
    return FilterState(
        mean=state.mean + gain * innovation,
        variance=(1.0 - gain) * predicted,
        process_noise=np.where(located, BASE_PROCESS_NOISES[state.rule], forgotten),
        seen=state.seen | located,
        rule=state.rule,
    )
