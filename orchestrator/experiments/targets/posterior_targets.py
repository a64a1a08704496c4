"""Targets for a filter's posterior, on flights around people with exact depth."""

from collections.abc import Iterator, Sequence

from orchestrator.experiments.figures.posterior_figures import SETTLED, Posterior
from orchestrator.experiments.targets.target import NOISE, Target

MOST_ERROR = 0.035
"""Metres."""

WITHIN = (0.60, 0.75)
COVERAGE = (0.85, 0.95)


def posterior_targets(posteriors: Sequence[Posterior]) -> Iterator[Target]:
    """The targets of the circles; none without filters by variance."""
    for one in posteriors:
        if (one.noise, one.path) != (NOISE, "circle"):
            continue
        words = f"circles: the filter's mean error from picture {SETTLED} on, m"
        yield Target(words=words, value=one.settled.value, low=0.0, high=MOST_ERROR)
        for words, found, (low, high) in (
            ("errors along an axis within one deviation of the posterior", one.within, WITHIN),
            ("coverage of the posterior's 90% radius", one.coverage, COVERAGE),
        ):
            yield Target(words=f"circles: {words}", value=found.value, low=low, high=high)
