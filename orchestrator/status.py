"""How a run is right now, as its files and its processes tell."""

import time
from collections.abc import Mapping
from contextlib import ExitStack
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace
from rich.console import Group, RenderableType
from rich.text import Text

from orchestrator.heartbeat import SILENT, Health, Heartbeat, is_alive
from orchestrator.live_display import figures, workers_table
from orchestrator.restart import count_restarts
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
        is_finished: whether all that was to be done in it is done.
        phase: what the agent did last; None before its first word.
        restarts: how often each process was started again that failed.
    """

    run: str
    state: Literal["running", "abandoned", "not running"]
    phase: str | None
    progress: Progress | None
    workers: tuple[Health, ...]
    restarts: dict[str, int]
    is_finished: bool
    has_weights: bool
    has_evaluation: bool


def run_status(run: RunDirectory, patience: float = PATIENCE) -> RunStatus:
    """Look at a run without disturbing it."""
    processes = run.processes()
    alive = [process for process in processes if is_alive(process)]
    busy = run.is_busy()
    progress, restarts = run.progress(), count_restarts(run.restarts())
    return RunStatus(
        run=str(run.path),
        state="running" if busy else "abandoned" if alive else "not running",
        phase=progress.phase if progress else None,
        progress=progress,
        workers=_health_of(processes, restarts, patience),
        restarts=restarts,
        is_finished=run.is_finished(),
        has_weights=run.weights_path.is_file(),
        has_evaluation=run.evaluation_path.is_file(),
    )


def _health_of(
    processes: tuple[ProcessRecord, ...], restarts: Mapping[str, int], patience: float
) -> tuple[Health, ...]:
    deadline = time.monotonic() + patience
    with ExitStack() as stack:
        heartbeats = [stack.enter_context(Heartbeat(process, Timeouts())) for process in processes]
        while True:
            heard = tuple(heartbeat.beat() for heartbeat in heartbeats)
            if time.monotonic() >= deadline or all(health.state != SILENT for health in heard):
                return tuple(replace(health, restarts=restarts.get(health.name, 0)) for health in heard)
            time.sleep(POLL)


def _resume(status: RunStatus) -> str:
    return f"go on with it by 'orchestrator resume {status.run}'"


def status_view(status: RunStatus) -> RenderableType:
    """The status as a few lines."""
    style = {"running": "bold green", "abandoned": "bold red", "not running": "bold yellow"}[status.state]
    lines: list[RenderableType] = [Text.assemble(status.run, "  ", (status.state, style))]
    if status.state == "abandoned":
        lines.append(Text(f"its orchestrator is gone, and some of its processes go on for a while: {_resume(status)}"))
    elif status.state == "not running" and not status.is_finished:
        lines.append(Text(f"it has not come to its end: {_resume(status)}"))
    if status.progress is None:
        lines.append(Text("its agent has not said anything yet"))
    else:
        lines.append(Text("   ".join(figures(status.progress))))
    made = [name for name, there in (("weights", status.has_weights), ("evaluation", status.has_evaluation)) if there]
    lines.append(Text(f"made so far: {', '.join(made) or 'no weights yet'}", "dim"))
    if status.workers:
        lines.append(workers_table(status.workers))
    return Group(*lines)
