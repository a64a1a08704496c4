"""The calibration of a filter's posterior: errors within its deviation, and joints within its 90% radius."""

from collections.abc import Iterator, Mapping

import numpy as np
from msgspec import Struct
from scipy.stats import chi2

from orchestrator.experiments.figures.bootstrap import Figure, figure, mean
from orchestrator.experiments.figures.sample import Sample, truth_of
from protocol.arrays import Float64Array

COVERAGE = 0.9
SETTLED = 10
"""The picture from which on a flight's filter counts as settled."""


class Posterior(Struct, frozen=True, kw_only=True):
    """Over all joints that the filter has seen.

    Attributes:
        within: share of the errors along an axis that are no larger than the posterior's deviation along it.
        coverage: of the sphere that the posterior says to hold the joint with probability 0.9.
        radius: of that sphere, metres, mean.
        settled: metres, mean error of the filter from picture `SETTLED` on.
    """

    noise: str
    path: str
    within: Figure
    coverage: Figure
    radius: Figure
    settled: Figure


def posteriors(samples: Mapping[tuple[str, str], Sample]) -> Iterator[Posterior]:
    """One for each depth noise and path."""
    for (noise, path), sample in samples.items():
        yield posterior(noise, path, sample)


def posterior(noise: str, path: str, sample: Sample) -> Posterior:
    """The figures of some flights."""
    person, drawn = sample.people()
    owner = np.broadcast_to(person[:, None], sample["seen"].shape)
    seen, settled = sample["seen"] > 0, (sample["step"] >= SETTLED)[:, None]
    variance = np.stack([sample[f"posterior_{axis}"] for axis in "xyz"], axis=2)
    estimate = np.stack([sample[f"filter_{axis}"] for axis in "xyz"], axis=2)
    error = estimate - truth_of(sample)
    radius = radius_of(variance)
    within = (error**2 <= variance).mean(axis=2)
    held = np.linalg.norm(error, axis=2) <= radius
    late = seen & settled
    return Posterior(
        noise=noise,
        path=path,
        within=figure(mean(within[seen], owner[seen], drawn)),
        coverage=figure(mean(held[seen], owner[seen], drawn)),
        radius=figure(mean(radius[seen], owner[seen], drawn)),
        settled=figure(mean(sample["filter_error"][late], owner[late], drawn)),
    )


def radius_of(variance: Float64Array) -> Float64Array:
    """(…,) metres: of a sphere that holds a point of a normal distribution with probability 0.9.

    The square of its distance is a sum of three chi-squares; it is taken for one of the same mean and variance, scaled.

    Args:
        variance: (…, 3) m² along the axes.
    """
    total, squares = variance.sum(axis=-1), (variance**2).sum(axis=-1)
    scale = squares / total
    return np.sqrt(scale * chi2.ppf(COVERAGE, total**2 / squares))
