"""The display of a command at work: a live view on a terminal, otherwise plain lines."""

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Literal, Protocol

from msgspec import Struct
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from orchestrator.supervision.heartbeat import NOT_RUNNING, RUNNING, SILENT, WAITING, Health
from protocol.messages import State
from protocol.records import Progress, Stage

LINE_INTERVAL = 5.0
BAR_WIDTH = 40
LONGEST_STATE = len(NOT_RUNNING)
STATE_STYLES = {
    State.STARTING.value: "yellow",
    State.READY.value: "green",
    State.BUSY.value: "bold green",
    State.DRAINING.value: "yellow",
    RUNNING: "green",
    WAITING: "yellow",
    SILENT: "bold red",
    NOT_RUNNING: "red",
}


class FrameCount(Struct, frozen=True, kw_only=True):
    """The progress of an experiment, in frames or in steps of trainings."""

    step: int
    steps: int
    steps_per_second: float
    unit: Literal["frames", "steps"] = "frames"


class Snapshot(Struct, frozen=True, kw_only=True):
    """The state of a run at one moment.

    Attributes:
        activity: what the command does or waits for.
        elapsed: seconds since the command began.
        warning: the last warning of any process.
    """

    activity: str
    elapsed: float
    progress: Progress | FrameCount | None = None
    workers: tuple[Health, ...] = ()
    warning: str | None = None


class Display(Protocol):
    """Shows snapshots, as often as it decides itself."""

    def show(self, snapshot: Snapshot) -> None:
        """Show the present state of the run."""
        ...


@contextmanager
def open_display(console: Console) -> Generator[Display]:
    """A live view where the console is a terminal, otherwise plain lines."""
    if not console.is_terminal:
        yield LineDisplay(console)
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield LiveDisplay(live)


class SilentDisplay:
    """Displays nothing: for programs, and where changes are logged."""

    def show(self, snapshot: Snapshot) -> None:
        """See `Display`."""


class LiveDisplay:
    """Redraws the same few lines of a terminal."""

    def __init__(self, live: Live) -> None:
        self._live = live

    def show(self, snapshot: Snapshot) -> None:
        """Redraw."""
        self._live.update(snapshot_view(snapshot), refresh=True)


class LineDisplay:
    """Writes a line when the activity changes, at each new warning, and every few seconds."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self._console = console
        self._clock = clock
        self._next = 0.0
        self._activity = ""
        self._warning: str | None = None

    def show(self, snapshot: Snapshot) -> None:
        """Write a line if one is due."""
        if snapshot.warning is not None and snapshot.warning != self._warning:
            self._warning = snapshot.warning
            self._write(f"warning: {snapshot.warning}")
        if snapshot.activity != self._activity or self._clock() >= self._next:
            self._activity = snapshot.activity
            self._next = self._clock() + LINE_INTERVAL
            self._write(snapshot_line(snapshot))

    def _write(self, line: str) -> None:
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)


def snapshot_line(snapshot: Snapshot) -> str:
    """The run in one line."""
    parts = [f"{duration(snapshot.elapsed)}  {snapshot.activity}"]
    if snapshot.progress is not None:
        parts += figures(snapshot.progress)
        if isinstance(snapshot.progress, FrameCount):
            parts.append(_remaining(snapshot.progress))
    parts.append(", ".join(f"{worker.name} {worker.state}" for worker in snapshot.workers))
    return "  ".join(part for part in parts if part)


def snapshot_view(snapshot: Snapshot) -> RenderableType:
    """The run as a few lines for a terminal."""
    rows: list[RenderableType] = [Text.assemble((snapshot.activity, "bold"), f"  {duration(snapshot.elapsed)}")]
    if snapshot.progress is not None:
        rows += [_bar(snapshot.progress), Text("   ".join(figures(snapshot.progress)))]
        if isinstance(snapshot.progress, Progress) and snapshot.progress.stages:
            rows.append(Text(stages_text(snapshot.progress.stages), style="dim"))
    if snapshot.workers:
        rows.append(workers_table(snapshot.workers))
    if snapshot.warning is not None:
        rows.append(Text(f"last warning: {snapshot.warning}", style="yellow", overflow="ellipsis", no_wrap=True))
    return Group(*rows)


def figures(progress: Progress | FrameCount) -> Iterator[str]:
    """The figures of a progress, each in a few words."""
    if isinstance(progress, FrameCount):
        yield f"{progress.step}/{progress.steps} {progress.unit}"
        yield f"{progress.steps_per_second:.1f} {progress.unit}/s"
        return
    yield f"{progress.phase} {progress.step}/{progress.steps}"
    yield f"{progress.steps_per_second:.1f} steps/s"
    if progress.episode_return is not None:
        yield f"return {progress.episode_return:.1f}"
    if progress.uncertainty is not None:
        yield f"uncertainty {progress.uncertainty:.3g}"


def stages_text(stages: Mapping[Stage, float]) -> str:
    """Median milliseconds an environment step spends in each stage."""
    return " · ".join(f"{stage} {1000 * seconds:.1f} ms" for stage, seconds in stages.items())


def workers_table(workers: Sequence[Health]) -> Table:
    """One row a process: its name, its state, its counts."""
    table = Table(box=None, padding=(0, 3, 0, 0), header_style="dim")
    table.add_column("process")
    table.add_column("state", min_width=LONGEST_STATE)
    for heading in ("answered", "in hand", "memory", "restarts", "pid"):
        table.add_column(heading, justify="right")
    for worker in workers:
        memory = "" if worker.resident_bytes is None else f"{worker.resident_bytes / 2**20:.0f} MiB"
        table.add_row(
            worker.name,
            Text(worker.state, style=STATE_STYLES.get(worker.state, "")),
            "" if worker.answered is None else str(worker.answered),
            "" if worker.queue_depth is None else str(worker.queue_depth),
            memory,
            str(worker.restarts) if worker.restarts else "",
            str(worker.pid),
        )
    return table


def duration(seconds: float) -> str:
    """A duration as `m:ss`, or `h:mm:ss` from an hour on."""
    minutes, left = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{left:02d}" if hours else f"{minutes}:{left:02d}"


def _bar(progress: Progress | FrameCount) -> RenderableType:
    bar = Table.grid(padding=(0, 2, 0, 0))
    bar.add_row(
        ProgressBar(total=max(progress.steps, 1), completed=progress.step, width=BAR_WIDTH),
        Text(_remaining(progress), style="dim"),
    )
    return bar


def _remaining(progress: Progress | FrameCount) -> str:
    if progress.steps_per_second <= 0 or progress.step >= progress.steps:
        return ""
    return f"{duration((progress.steps - progress.step) / progress.steps_per_second)} left"
