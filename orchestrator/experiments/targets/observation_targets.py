"""What the figures are held against: the thesis's claim as we read it, and what a calibrated uncertainty has to reach.

A learned lifter has to reach more, and places in space besides: see `lifting_targets`.
"""

from collections.abc import Iterator

from orchestrator.experiments.figures.observation_figures import Coverage, QoeFigures, Score
from orchestrator.experiments.targets.lifting_targets import lifting_targets
from orchestrator.experiments.targets.target import NOISE, Target

THESIS, CALIBRATED = "quality, mean", "expected error"


def targets(figures: QoeFigures) -> Iterator[Target]:
    """Those of the thesis's quality, and those of the learned lifter or of the calibration where there is one."""
    if (thesis := _score(figures, THESIS, "all")) is not None:
        words = "thesis's quality: ρ of frames, all joints, clipped"
        yield Target(words=words, value=thesis.all_clipped.value, low=0.60)
    if (near := _score(figures, THESIS, "under 3 m")) is not None:
        words = "thesis's quality: ρ of frames, located joints, raw, under 3 m"
        yield Target(words=words, value=near.located_raw.value, low=0.50)
    yield from lifting_targets(figures) if figures.lifted else _calibrated(figures)


def _calibrated(figures: QoeFigures) -> Iterator[Target]:
    if (ours := _score(figures, CALIBRATED, "all")) is not None:
        for words, found, low in (
            ("ρ of frames, located joints, raw", ours.located_raw, 0.64),
            ("ρ of frames, located joints, clipped", ours.located_clipped, 0.75),
            ("AUROC of a joint's error above 0.15 m", ours.joint_auroc, 0.85),
        ):
            yield Target(words=f"expected error: {words}", value=found.value, low=low)
    yield from _coverage(figures)


def _coverage(figures: QoeFigures) -> Iterator[Target]:
    own = [one for one in figures.coverage if one.noise == NOISE]
    for words, chosen, low, high in (
        ("coverage of the 90% radius", [one for one in own if (one.band, one.joint) == ("all", "all")], 0.88, 0.92),
        ("the least coverage of a band", [one for one in own if one.band != "all"], 0.80, 1.0),
        ("the least coverage of a joint", [one for one in own if one.joint != "all"], 0.80, 1.0),
    ):
        if chosen:
            least = min(chosen, key=_share)
            where = least.joint if least.joint != "all" else least.band
            yield Target(words=f"{words} ({where})", value=least.coverage.value, low=low, high=high)


def _share(coverage: Coverage) -> float:
    return coverage.coverage.value


def _score(figures: QoeFigures, uncertainty: str, band: str) -> Score | None:
    return next(
        (one for one in figures.scores if (one.noise, one.uncertainty, one.band) == (NOISE, uncertainty, band)),
        None,
    )
