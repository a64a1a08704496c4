"""The result of a rehearsal, as JSON and as text."""

import statistics
from collections.abc import Sequence

from msgspec import Struct
from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from orchestrator.chaos.comparison import Comparison
from orchestrator.monitoring.live_display import duration


class PlayedFault(Struct, frozen=True, kw_only=True):
    """A fault that happened.

    Attributes:
        step: environment steps of all drones before the fault, prefill included.
        seconds: until the first progress beyond that step.
        steps_again: steps that were repeated, since they came after the last checkpoint.
        broken: the invariant that did not hold, in words; None where all held.
    """

    scenario: str
    step: int
    seconds: float
    steps_again: int
    broken: str | None = None


class ClassReport(Struct, frozen=True, kw_only=True):
    """The faults of one class: seconds to recover, and the most steps that one of them repeated."""

    faults: int
    median_seconds: float
    worst_seconds: float
    most_steps_again: int


class ChaosReport(Struct, frozen=True, kw_only=True):
    """The output of `chaos --json`.

    Attributes:
        passed: whether both runs have equal results, every fault happened and every invariant held.
        not_played: faults that did not happen, each with the reason.
        retries, late_replies: counts of the agent's last process.
        restarts: the number of restarts of each process.
        control_run: the directory of the run without faults.
        control_run_reused: whether an earlier rehearsal of the same configuration and code made it.
        touched: the directory of the run under faults.
    """

    config: str
    seed: int
    passed: bool
    comparison: Comparison
    classes: dict[str, ClassReport]
    faults: tuple[PlayedFault, ...]
    not_played: tuple[str, ...]
    retries: int
    late_replies: int
    restarts: dict[str, int]
    control_run: str
    control_run_reused: bool
    touched: str
    seconds: float


def by_class(faults: Sequence[PlayedFault]) -> dict[str, ClassReport]:
    """The faults by class, in the order of their names."""
    gathered: dict[str, list[PlayedFault]] = {}
    for fault in faults:
        gathered.setdefault(fault.scenario, []).append(fault)
    return {
        name: ClassReport(
            faults=len(played),
            median_seconds=statistics.median(fault.seconds for fault in played),
            worst_seconds=max(fault.seconds for fault in played),
            most_steps_again=max(fault.steps_again for fault in played),
        )
        for name, played in sorted(gathered.items())
    }


def report_view(report: ChaosReport) -> RenderableType:
    """The report for a terminal."""
    same = report.comparison
    lines: list[RenderableType] = [
        Text.assemble(
            (f"{len(report.faults)} faults, seed {report.seed}: ", "bold"),
            ("equal byte for byte", "bold green") if same.identical else ("not equal", "bold red"),
            f", after {duration(report.seconds)}",
        ),
        Text(f"weights {_same(same.weights)}, episodes {_same(same.episodes)}, replay {_same(same.replay)}"),
        Text(f"{same.transitions} transitions, {same.lost} lost, {same.doubled} doubled"),
        *(Text(difference, "red") for difference in same.differences),
        *(Text(f"{fault.scenario}: {fault.broken}", "red") for fault in report.faults if fault.broken),
        *(Text(f"not played: {words}", "red") for words in report.not_played),
        _classes_table(report.classes),
        Text(_counts(report), "dim"),
        Text(f"control run: {report.control_run}{' (reused)' if report.control_run_reused else ''}"),
        Text(f"run under faults: {report.touched}"),
    ]
    return Group(*lines)


def _classes_table(classes: dict[str, ClassReport]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column("fault")
    for heading in ("times", "median, s", "worst, s", "steps again"):
        table.add_column(heading, justify="right")
    for name, found in classes.items():
        figures = (f"{found.median_seconds:.1f}", f"{found.worst_seconds:.1f}", str(found.most_steps_again))
        table.add_row(name, str(found.faults), *figures)
    return table


def _counts(report: ChaosReport) -> str:
    restarts = ", ".join(f"{name} {count}" for name, count in report.restarts.items()) or "none"
    return f"retries {report.retries}, late replies {report.late_replies}, restarts: {restarts}"


def _same(same: bool) -> str:
    return "identical" if same else "DIFFERENT"
