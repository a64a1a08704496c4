"""The evaluation as a table for display."""

from collections.abc import Callable

from rich import box
from rich.table import Table
from rich.text import Text

from protocol.records import Evaluation, Interval, PolicyScore


def evaluation_table(evaluation: Evaluation) -> Table:
    """One row a policy, each figure with its 95% interval below it: so it fits a terminal of 80 columns."""
    episodes = max((score.episodes for score in evaluation.scores), default=0)
    table = Table(
        title=f"{episodes} flights on test identities (seeds from {evaluation.first_seed})",
        caption=_caption(evaluation),
        title_justify="left",
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("policy")
    for heading in ("return", "uncertainty", "success", "crash", "length"):
        table.add_column(heading, justify="right", no_wrap=True)
    for number, score in enumerate(evaluation.scores):
        table.add_row(*_row(score, evaluation.in_metres), style="bold" if number == 0 else "")
    return table


def _caption(evaluation: Evaluation) -> str:
    threshold = evaluation.success_threshold
    if evaluation.in_metres:
        return f"mean, 95% interval; success: hand and upper body certain, that to {threshold:g} m; uncertainty in m"
    return f"mean, 95% interval; success: uncertainty below {threshold:g} of 10"


def _row(score: PolicyScore, in_metres: bool) -> tuple[Text, ...]:
    figures: tuple[tuple[Interval, Callable[[float], str]], ...] = (
        (score.total_reward, _with_decimals(1)),
        (score.uncertainty, _with_decimals(4 if in_metres else 2)),
        (score.success, _percent),
        (score.crash, _percent),
        (score.length, _with_decimals(0)),
    )
    return Text(score.policy), *(Text(interval_text(interval, show)) for interval, show in figures)


def interval_text(interval: Interval, show: Callable[[float], str]) -> str:
    """The mean, and `[low, high]` on the line below."""
    return f"{show(interval.mean)}\n[{show(interval.low)}, {show(interval.high)}]"


def _with_decimals(decimals: int) -> Callable[[float], str]:
    return lambda value: f"{value:.{decimals}f}"


def _percent(value: float) -> str:
    return f"{100 * value:.0f}%"
