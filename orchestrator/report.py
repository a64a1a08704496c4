"""What a run came to, for programs (`--json`) and for people."""

from typing import get_args

from msgspec import Struct
from rich.console import Group, RenderableType
from rich.text import Text

from orchestrator.live_display import duration, stages_text
from orchestrator.run_directory import RunDirectory
from orchestrator.table import evaluation_table
from protocol.records import Evaluation, Stage


class TrainingReport(Struct, frozen=True, kw_only=True):
    """What `train --json` prints.

    Attributes:
        run: the run directory.
        interrupted: whether somebody stopped it before its end.
        stages: median seconds an environment step spends in each stage; None for a stage that none was measured of.
        evaluation: None where none was flown.
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
    evaluation: Evaluation | None


def training_report(run: RunDirectory, *, interrupted: bool) -> TrainingReport | None:
    """What a training came to; None where it ended before the agent's summary."""
    summary = run.summary()
    if summary is None:
        return None
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
        evaluation=run.evaluation(),
    )


def report_view(report: TrainingReport) -> RenderableType:
    """The report as a few lines, the evaluation's table last."""
    trained = (
        f"{report.steps} steps in {duration(report.seconds)} ({report.steps_per_second:.1f} steps/s), "
        f"{report.episodes} episodes, {report.updates} gradient updates"
    )
    lines: list[RenderableType] = [
        Text(f"{'stopped after' if report.interrupted else 'trained'} {trained}", "bold"),
        Text(stages_text({stage: seconds for stage, seconds in report.stages.items() if seconds is not None})),
        Text(f"late replies {report.late_replies}, retries {report.retries}", "dim"),
        Text(f"run: {report.run}"),
    ]
    if report.evaluation is not None:
        lines.append(evaluation_table(report.evaluation))
    return Group(*lines)
