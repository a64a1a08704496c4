"""How a run is right now, as its files and its processes tell."""

import time
from contextlib import ExitStack
from typing import Literal

from msgspec import Struct
from rich.console import Group, RenderableType
from rich.text import Text

from orchestrator.heartbeat import SILENT, Health, Heartbeat, is_alive
from orchestrator.live_display import figures, workers_table
from orchestrator.run_directory import ProcessRecord, RunDirectory
from protocol.records import Progress
from protocol.timeouts import Timeouts

PATIENCE = 2.0
"""Seconds to wait for the workers' answers."""
POLL = 0.05


class RunStatus(Struct, frozen=True, kw_only=True):
    """What `status` prints.

    Attributes:
        state: `running` while an orchestrator works on it, `abandoned` where processes go on without one, else
            `not running`.
        phase: what the agent did last; None before its first word.
    """

    run: str
    state: Literal["running", "abandoned", "not running"]
    phase: str | None
    progress: Progress | None
    workers: tuple[Health, ...]
    has_weights: bool
    has_evaluation: bool


def run_status(run: RunDirectory, patience: float = PATIENCE) -> RunStatus:
    """Look at a run without disturbing it."""
    processes = run.processes()
    alive = [process for process in processes if is_alive(process)]
    busy = run.is_busy()
    progress = run.progress()
    return RunStatus(
        run=str(run.path),
        state="running" if busy else "abandoned" if alive else "not running",
        phase=progress.phase if progress else None,
        progress=progress,
        workers=_health_of(processes, patience),
        has_weights=run.weights_path.is_file(),
        has_evaluation=run.evaluation_path.is_file(),
    )


def _health_of(processes: tuple[ProcessRecord, ...], patience: float) -> tuple[Health, ...]:
    deadline = time.monotonic() + patience
    with ExitStack() as stack:
        heartbeats = [stack.enter_context(Heartbeat(process, Timeouts())) for process in processes]
        while True:
            heard = tuple(heartbeat.beat() for heartbeat in heartbeats)
            if time.monotonic() >= deadline or all(health.state != SILENT for health in heard):
                return heard
            time.sleep(POLL)


def status_view(status: RunStatus) -> RenderableType:
    """The status as a few lines."""
    style = {"running": "bold green", "abandoned": "bold red", "not running": "bold yellow"}[status.state]
    lines: list[RenderableType] = [Text.assemble(status.run, "  ", (status.state, style))]
    if status.state == "abandoned":
        lines.append(Text("its orchestrator is gone, and some of its processes go on; end those by their pid"))
    if status.progress is None:
        lines.append(Text("its agent has not said anything yet"))
    else:
        lines.append(Text("   ".join(figures(status.progress))))
    made = [name for name, there in (("weights", status.has_weights), ("evaluation", status.has_evaluation)) if there]
    lines.append(Text(f"made so far: {', '.join(made) or 'no weights yet'}", "dim"))
    if status.workers:
        lines.append(workers_table(status.workers))
    return Group(*lines)
