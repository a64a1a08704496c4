"""The results of the exploration experiment: each variant's figures over its seeds, beside the thesis's table."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from msgspec import Struct
from scipy import stats

from orchestrator.experiments.figures.bootstrap import Figure
from orchestrator.experiments.grid.variants import VARIANTS
from orchestrator.run.run_directory import RunDirectory
from protocol.errors import InvalidInput
from protocol.grid.records import FailureMode, GridEvaluation, GridScore, GridThreshold

_CONFIDENCE = 0.95


class TrainedRun(Struct, frozen=True, eq=False):
    """A training that was evaluated.

    Attributes:
        seconds: that it trained, in all.
    """

    variant: str
    directory: RunDirectory
    evaluation: GridEvaluation
    steps: int
    seconds: float


class VariantFigures(Struct, frozen=True, kw_only=True):
    """The figures of a policy at a threshold, over seeds; intervals are Student's, of the mean over seeds.

    Attributes:
        length_deviation: standard deviation of the lengths of all episodes, mean over seeds.
        failures: of all seeds together.
    """

    policy: str
    seeds: int
    success: Figure
    success_of_solvable: Figure
    crash: Figure
    length: Figure
    length_deviation: float
    success_length: Figure
    ratio: Figure
    failures: dict[FailureMode, int]


class ThresholdFigures(Struct, frozen=True, kw_only=True):
    """All policies on one table at one threshold.

    Attributes:
        ceiling, optimum: see `GridThreshold`.
    """

    table: str
    threshold: float
    environments: int
    ceiling: float
    optimum: float | None
    policies: tuple[VariantFigures, ...]


class GridFigures(Struct, frozen=True, kw_only=True):
    """The output of `experiment grid report --json`.

    Attributes:
        hours: of training in all, each on one core.
    """

    trainings: int
    steps: int
    hours: float
    thresholds: tuple[ThresholdFigures, ...]


def trained_runs(out: Path) -> tuple[TrainedRun, ...]:
    """The trainings of an experiment that were evaluated, by variant and seed.

    Raises:
        InvalidInput: there is none.
    """
    found = [run for variant in VARIANTS for run in _runs_of(out, variant)]
    if not found:
        raise InvalidInput(
            f"{out} has no evaluated training; make some by 'orchestrator experiment grid train --out {out}'"
        )
    return tuple(found)


def grid_figures(runs: Sequence[TrainedRun]) -> GridFigures:
    """The figures of an experiment's trainings."""
    places = dict.fromkeys(
        (run.evaluation.table, threshold.threshold) for run in runs for threshold in run.evaluation.thresholds
    )
    return GridFigures(
        trainings=len(runs),
        steps=sum(run.steps for run in runs),
        hours=sum(run.seconds for run in runs) / 3600,
        thresholds=tuple(_at(runs, table, threshold) for table, threshold in places),
    )


def seed_figure(values: Iterable[float | None]) -> Figure:
    """The mean over seeds, and Student's 95% interval of it; NaN where there is none."""
    sample = np.array([value for value in values if value is not None], float)
    if not len(sample):
        return Figure(value=math.nan, low=math.nan, high=math.nan)
    mean = float(sample.mean())
    if len(sample) == 1:
        return Figure(value=mean, low=math.nan, high=math.nan)
    half = float(stats.t.ppf((1 + _CONFIDENCE) / 2, len(sample) - 1) * sample.std(ddof=1) / math.sqrt(len(sample)))
    return Figure(value=mean, low=mean - half, high=mean + half)


def seed_share(values: Iterable[float]) -> Figure:
    """The same of shares: the interval ends at 0 and 1."""
    figure = seed_figure(values)
    # NaN stays: a comparison with it is false.
    return Figure(value=figure.value, low=max(figure.low, 0.0), high=min(figure.high, 1.0))


def _runs_of(out: Path, variant: str) -> Iterable[TrainedRun]:
    for path in sorted(out.glob(f"{variant}-seed-*"), key=lambda path: (len(path.name), path.name)):
        directory = RunDirectory(path)
        evaluation, summary = directory.grid_evaluation(), directory.summary()
        if evaluation is not None and summary is not None:
            yield TrainedRun(variant, directory, evaluation, summary.steps, summary.seconds)


def _at(runs: Sequence[TrainedRun], table: str, threshold: float) -> ThresholdFigures:
    scored = [
        (run, found)
        for run in runs
        if run.evaluation.table == table and (found := _threshold_of(run.evaluation, threshold)) is not None
    ]
    first_run, first = scored[0]
    by_variant = {name: [found.scores[0] for run, found in scored if run.variant == name] for name in VARIANTS}
    trained = [_figures(name, scores) for name, scores in by_variant.items() if scores]
    return ThresholdFigures(
        table=table,
        threshold=threshold,
        environments=first_run.evaluation.environments,
        ceiling=first.ceiling,
        optimum=first.optimum,
        # No baseline learns, so each scores the same in every run.
        policies=(*trained, *(_figures(score.policy, [score]) for score in first.scores[1:])),
    )


def _threshold_of(evaluation: GridEvaluation, threshold: float) -> GridThreshold | None:
    return next((one for one in evaluation.thresholds if one.threshold == threshold), None)


def _figures(name: str, scores: Sequence[GridScore]) -> VariantFigures:
    def over_seeds(of: Callable[[GridScore], float | None]) -> Figure:
        return seed_figure(of(score) for score in scores)

    return VariantFigures(
        policy=name,
        seeds=len(scores),
        success=seed_share(score.success.mean for score in scores),
        success_of_solvable=seed_share(score.success_of_solvable.mean for score in scores),
        crash=seed_share(score.crash.mean for score in scores),
        length=over_seeds(lambda score: score.length.mean),
        length_deviation=float(np.mean([score.length_deviation for score in scores])),
        success_length=over_seeds(lambda score: score.success_length and score.success_length.mean),
        ratio=over_seeds(lambda score: score.ratio),
        failures={mode: sum(score.failures[mode] for score in scores) for mode in scores[0].failures},
    )
