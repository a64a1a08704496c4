"""Targets for a learned lifter: the error of its joints, and the coverage of its radius."""

from collections.abc import Iterable, Iterator, Mapping

from orchestrator.experiments.figures.lifting_figures import UNSEEN_KINDS, LiftedJoints
from orchestrator.experiments.figures.observation_figures import Coverage, QoeFigures
from orchestrator.experiments.figures.sample import BANDS, WRONG_OF_LEARNED
from orchestrator.experiments.targets.target import NOISE, STEREO, Target
from orchestrator.experiments.views import FAMILIES

MOST_ERROR: Mapping[str, float] = {"seen": 0.05, "wrists": 0.10, "inferred": 0.10}
MOST_ERROR_OF_UNSEEN_KIND, MOST_ERROR_WITH_NOISE, MOST_ERROR_OF_FAMILY = 0.06, 0.065, 0.07
MOST_RADIUS = 0.10
"""Metres: mean errors of seen joints where nothing else is said, and the median radius of these."""

COVERAGE = (0.88, 0.92)
LEAST_COVERAGE, LEAST_COVERAGE_OF_FAMILY = 0.85, 0.80
LEAST_CORRELATION, LEAST_AUROC = 0.70, 0.85


def lifting_targets(figures: QoeFigures) -> Iterator[Target]:
    """The targets for families of poses if the people are in these, otherwise all other targets."""
    if figures.poses == "families":
        yield from _of_families(figures)
        return
    yield from _errors(figures)
    yield from _coverages(figures)
    for one in figures.scores:
        if (one.noise, one.uncertainty, one.band) == (NOISE, "expected error", "all"):
            words, rho = "expected error: ρ of frames, seen joints, raw", one.located_raw.value
            yield Target(words=words, value=rho, low=LEAST_CORRELATION)
            words = f"expected error: AUROC of a seen joint's error above {WRONG_OF_LEARNED:.2f} m"
            yield Target(words=words, value=one.joint_auroc.value, low=LEAST_AUROC)


def _errors(figures: QoeFigures) -> Iterator[Target]:
    for sort, most in MOST_ERROR.items():
        for one in _chosen(figures, NOISE, ["all"], sort):
            yield Target(words=f"mean error, m: {_WORDS[sort]}", value=one.error.value, low=0.0, high=most)
    yield from _worst_error(figures, "an unseen kind of pose", UNSEEN_KINDS, MOST_ERROR_OF_UNSEEN_KIND)
    for one in _chosen(figures, STEREO, ["all"], "seen"):
        words = "mean error, m: seen joints"
        yield Target(words=words, value=one.error.value, low=0.0, high=MOST_ERROR_WITH_NOISE, noise=STEREO)
    for one in _chosen(figures, NOISE, ["all"], "seen"):
        yield Target(words="median radius, m: seen joints", value=one.radius.value, low=0.0, high=MOST_RADIUS)


def _coverages(figures: QoeFigures) -> Iterator[Target]:
    low, high = COVERAGE
    for one in _chosen(figures, NOISE, ["all"], "all"):
        yield Target(words="coverage of the 90% radius", value=one.coverage.value, low=low, high=high)
    joints = [one for one in figures.coverage if one.noise == NOISE and one.joint != "all"]
    if joints:
        least = min(joints, key=_share)
        words = f"the least coverage of a joint ({least.joint})"
        yield Target(words=words, value=least.coverage.value, low=LEAST_COVERAGE)
    yield from _least_coverage(figures, "a band", [band for band in BANDS if band != "all"], LEAST_COVERAGE)
    for noise, sort in ((NOISE, "seen"), (NOISE, "inferred"), (STEREO, "all")):
        for one in _chosen(figures, noise, ["all"], sort):
            words = f"coverage: {_WORDS[sort]}"
            yield Target(words=words, value=one.coverage.value, low=LEAST_COVERAGE, noise=noise)


def _of_families(figures: QoeFigures) -> Iterator[Target]:
    yield from _worst_error(figures, "a family", FAMILIES, MOST_ERROR_OF_FAMILY)
    yield from _least_coverage(figures, "a family", FAMILIES, LEAST_COVERAGE_OF_FAMILY)


def _worst_error(figures: QoeFigures, words: str, groups: Iterable[str], most: float) -> Iterator[Target]:
    """The greatest error of seen joints among the groups."""
    if found := _chosen(figures, NOISE, groups, "seen"):
        worst = max(found, key=_error)
        words = f"the greatest mean error of {words}, m: seen joints ({worst.group})"
        yield Target(words=words, value=worst.error.value, low=0.0, high=most)


def _least_coverage(figures: QoeFigures, words: str, groups: Iterable[str], low: float) -> Iterator[Target]:
    """The least coverage of all joints among the groups."""
    if found := _chosen(figures, NOISE, groups, "all"):
        least = min(found, key=_held)
        yield Target(words=f"the least coverage of {words} ({least.group})", value=least.coverage.value, low=low)


def _chosen(figures: QoeFigures, noise: str, groups: Iterable[str], sort: str) -> list[LiftedJoints]:
    """The figures of these groups, of groups with any joint."""
    wanted = set(groups)
    own = [one for one in figures.lifted if (one.noise, one.sort) == (noise, sort) and one.joints]
    return [one for one in own if one.group in wanted]


_WORDS = {"all": "all joints", "seen": "seen joints", "wrists": "seen wrists", "inferred": "inferred joints"}


def _error(one: LiftedJoints) -> float:
    return one.error.value


def _held(one: LiftedJoints) -> float:
    return one.coverage.value


def _share(one: Coverage) -> float:
    return one.coverage.value
