"""The evaluation of a run on the grid as tables for display."""

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from protocol.grid.records import GridEvaluation, GridScore, GridThreshold
from protocol.records import Interval


def grid_tables(evaluation: GridEvaluation) -> RenderableType:
    """A table for each threshold."""
    return Group(*(_threshold_table(evaluation, threshold) for threshold in evaluation.thresholds))


def _threshold_table(evaluation: GridEvaluation, threshold: GridThreshold) -> Table:
    optimum = "no cell succeeds" if threshold.optimum is None else f"the shortest path is {threshold.optimum:.1f} steps"
    table = Table(
        title=f"uncertainty below {threshold.threshold:g}: {evaluation.environments} {evaluation.split} environments "
        f"of {evaluation.table}",
        caption=f"{threshold.ceiling:.1%} of the environments can be solved, {optimum}; every start, 95% intervals",
        title_justify="left",
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("policy")
    for heading in ("success", "of solvable", "crash", "length", "of successes", "× optimum"):
        table.add_column(heading, justify="right", no_wrap=True)
    for number, score in enumerate(threshold.scores):
        table.add_row(*_row(score), style="bold" if number == 0 else "")
    return table


def _row(score: GridScore) -> tuple[Text, ...]:
    length = f"{score.length.mean:.1f} ± {score.length_deviation:.1f}\n{_range(score.length, '.1f')}"
    won = (
        ""
        if score.success_length is None
        else f"{score.success_length.mean:.1f}\n{_range(score.success_length, '.1f')}"
    )
    ratio = "" if score.ratio is None else f"{score.ratio:.2f}"
    rates = (_rate(rate) for rate in (score.success, score.success_of_solvable, score.crash))
    return tuple(map(Text, (score.policy, *rates, length, won, ratio)))


def _rate(rate: Interval) -> str:
    return f"{rate.mean:.1%}\n{_range(rate, '.1%')}"


def _range(interval: Interval, form: str) -> str:
    return f"[{interval.low:{form}}, {interval.high:{form}}]"
