"""Uncertainty and error of whole frames: means over their joints, by two definitions.

*Located*: over the joints that were located; frames without any are left out. *All*: over all 18, where a joint that
has no place has the uncertainty of a missing one and its error is measured from the centroid of those that have; frames
without any have no centroid and are left out as well. Where a learned lifter inferred joints that were not detected,
these are not located, and have a place and an uncertainty of their own.
"""

import numpy as np
from msgspec import Struct

from orchestrator.experiments.figures.sample import LARGEST_ERROR, Estimates
from protocol.arrays import BoolArray, Float64Array


class Frames(Struct, frozen=True, eq=False):
    """(n,) each: which of the sample's frames they are is `kept`, (frames,) booleans.

    Attributes:
        uncertainty: mean over a frame's joints.
        error: likewise, metres; `clipped`: with `LARGEST_ERROR` a joint at most.
    """

    kept: BoolArray
    uncertainty: Float64Array
    error: Float64Array
    clipped: Float64Array


def located_only(estimates: Estimates) -> Frames:
    """Means over the joints that were located."""
    located = estimates.located
    kept = np.any(located, axis=1)
    weights = located[kept] / located[kept].sum(axis=1, keepdims=True)
    return _frames(kept, weights, estimates.uncertainty[kept], estimates.error[kept])


def all_joints(estimates: Estimates) -> Frames:
    """Means over all joints, those without a place at the centroid of the others."""
    placed = estimates.placed
    kept = np.any(placed, axis=1)
    placed, points, truth = placed[kept], estimates.points[kept], estimates.truth[kept]
    centroid = np.where(placed[..., None], points, 0.0).sum(axis=1) / placed.sum(axis=1)[:, None]
    from_centroid = np.linalg.norm(centroid[:, None] - truth, axis=2)
    error = np.where(placed, estimates.error[kept], from_centroid)
    uncertainty = np.where(placed, estimates.uncertainty[kept], estimates.missing)
    return _frames(kept, np.full(error.shape, 1 / error.shape[1]), uncertainty, error)


def _frames(kept: BoolArray, weights: Float64Array, uncertainty: Float64Array, error: Float64Array) -> Frames:
    def mean(values: Float64Array) -> Float64Array:
        return (weights * np.where(weights > 0, values, 0.0)).sum(axis=1)

    return Frames(kept, mean(uncertainty), mean(error), mean(np.minimum(error, LARGEST_ERROR)))
