"""The errors of a fitted network on people whom it has not seen turn its scales into errors and radii in metres.

Each kind of joint is calibrated by itself, left and right together, and joints that were found apart from those that
were not (split conformal prediction, Mondrian by joint).
"""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from perception_worker.calibration.conformal import conformal_quantile
from perception_worker.calibration.features import KIND
from perception_worker.lifter.evidence import SHARE
from perception_worker.lifter.fitting.batches import blinded
from perception_worker.lifter.fitting.frames import Frames
from perception_worker.lifter.lifter import estimate_of
from perception_worker.lifter.network import LifterNetwork
from perception_worker.lifter.stored import Certainty
from perception_worker.lifter.tokens import Seen, tokens_of
from protocol.arrays import BoolArray, Float64Array

LEAST_JOINTS = 50
"""Of a kind, to have factors of its own."""

_AT_ONCE = 2048
_LEAST_SCALE = 1e-4
_LARGEST_ERROR = 2.0
"""Metres. An error counts as this much at most in the expected error, so that a few don't decide all."""


class Trial(Struct, frozen=True, eq=False):
    """Joints of people that were not fitted on: (n, 18) each.

    Attributes:
        error, scale: metres.
        found: whether each was.
    """

    error: Float64Array
    scale: Float64Array
    found: BoolArray


def tried(network: LifterNetwork, frames: Frames, without: Sequence[str] = ()) -> Trial:
    """The errors of a network on frames, without the inputs that it was trained without."""
    errors, scales = [], []
    for first in range(0, len(frames), _AT_ONCE):
        some = frames.of(np.arange(first, min(first + _AT_ONCE, len(frames))))
        estimate = estimate_of(network, blinded(tokens_of(some.seen), without))
        errors.append(np.linalg.norm(estimate.points - some.joints, axis=2))
        scales.append(estimate.scale)
    found = np.isfinite(frames.seen.rays[:, :, 0])
    return Trial(np.concatenate(errors), np.maximum(np.concatenate(scales), _LEAST_SCALE), found)


def certainty_of(trial: Trial, *, found: bool) -> Certainty:
    """The factors of joints that were found, or of those that were not.

    A kind with too few joints (a neck is found nearly always) has the factors of all kinds together.

    Raises:
        InvalidInput: there are too few of all kinds.
    """
    errors, radii = [], []
    for kind in KIND:
        own = (trial.found == found) & (kind == KIND)
        chosen = own if np.count_nonzero(own) >= LEAST_JOINTS else trial.found == found
        error, scale = trial.error[chosen], trial.scale[chosen]
        radii.append(conformal_quantile(error / scale))
        errors.append(float(np.minimum(error, _LARGEST_ERROR).sum() / scale.sum()))
    return Certainty(error=tuple(errors), radius=tuple(radii))


def unmeasured_factor(network: LifterNetwork, frames: Frames, seen: Certainty) -> float:
    """The factor, 1 or more, by which radii hold joints that were found where no depth was measured."""
    trial = tried(network, replace(frames, seen=without_depth(frames.seen)))
    ratio = trial.error / (trial.scale * np.array(seen.radius))
    return max(1.0, conformal_quantile(ratio[trial.found]))


def without_depth(seen: Seen) -> Seen:
    """The same frames as if the depth camera had measured nothing."""
    nothing = np.full_like(seen.narrow, np.nan)
    nothing[:, :, SHARE] = 0.0
    return replace(seen, narrow=nothing, wide=nothing)
