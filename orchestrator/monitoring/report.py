"""The result of a run, as JSON and as text."""

from collections.abc import Iterator, Mapping
from typing import get_args

from msgspec import Struct
from rich.console import Group, RenderableType
from rich.text import Text

from orchestrator.monitoring.live_display import duration, stages_text
from orchestrator.monitoring.table import evaluation_table
from orchestrator.run.restart import count_restarts
from orchestrator.run.run_directory import RunDirectory
from protocol.records import Evaluation, Stage, Summary


class TrainingReport(Struct, frozen=True, kw_only=True):
    """The output of `train --json`.

    Attributes:
        run: the run directory.
        interrupted: whether it was stopped on request before its end.
        stages: median seconds that an environment step spends in each stage; None for a stage without measurements.
        restarts: how often each process was restarted after a failure.
        recycled: how often each worker was replaced at a limit of memory or requests.
        evaluation: None where there is none.
    """

    run: str
    interrupted: bool
    steps: int
    episodes: int
    updates: int
    seconds: float
    steps_per_second: float
    stages: dict[Stage, float | None]
    late_replies: int
    retries: int
    restarts: dict[str, int]
    recycled: dict[str, int]
    evaluation: Evaluation | None


def training_report(run: RunDirectory, *, interrupted: bool) -> TrainingReport | None:
    """The report of a training; None where it ended before the agent wrote a summary."""
    summary = run.summary()
    if summary is None:
        return None
    restarts = run.restarts()
    return TrainingReport(
        run=str(run.path),
        interrupted=interrupted,
        steps=summary.steps,
        episodes=summary.episodes,
        updates=summary.updates,
        seconds=summary.seconds,
        steps_per_second=summary.steps_per_second,
        stages={stage: summary.stages.get(stage) for stage in get_args(Stage)},
        late_replies=summary.late_replies,
        retries=summary.retries,
        restarts=count_restarts(restarts),
        recycled=count_restarts(restarts, planned=True),
        evaluation=run.evaluation(),
    )


def report_view(report: TrainingReport) -> RenderableType:
    """The report as a few lines, and the table of the evaluation."""
    lines: list[RenderableType] = [
        Text(trained_words(report, "stopped after" if report.interrupted else "trained"), "bold"),
        Text(stages_text({stage: seconds for stage, seconds in report.stages.items() if seconds is not None})),
        Text(f"late replies {report.late_replies}, retries {report.retries}", "dim"),
        *_counts("restarts", report.restarts),
        *_counts("replaced", report.recycled),
        Text(f"run: {report.run}"),
    ]
    if report.evaluation is not None:
        lines.append(evaluation_table(report.evaluation))
    return Group(*lines)


def trained_words(training: TrainingReport | Summary, verb: str = "trained") -> str:
    """The result of a training, in a line."""
    return (
        f"{verb} {training.steps} steps in {duration(training.seconds)} ({training.steps_per_second:.1f} steps/s), "
        f"{training.episodes} episodes, {training.updates} gradient updates"
    )


def _counts(heading: str, counts: Mapping[str, int]) -> Iterator[Text]:
    if counts:
        yield Text(f"{heading}: {', '.join(f'{name} {count}' for name, count in counts.items())}", "dim")
