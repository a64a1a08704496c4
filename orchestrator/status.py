"""How a run is right now, as its files and its processes tell."""

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from datetime import datetime
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

from msgspec import Struct
from msgspec.structs import replace
from rich.console import Group, RenderableType
from rich.text import Text

from orchestrator.heartbeat import SILENT, Health, Heartbeat, is_alive
from orchestrator.live_display import figures, workers_table
from orchestrator.report import trained_words
from orchestrator.restart import count_restarts
from orchestrator.run_directory import ProcessRecord, RunDirectory
from protocol.errors import DamagedRecord, InvalidConfig
from protocol.records import Evaluation, PolicyScore, Progress, Summary
from protocol.timeouts import Timeouts

PATIENCE = 2.0
"""Seconds to wait for the workers' answers."""
POLL = 0.05


State: TypeAlias = Literal["running", "abandoned", "finished", "stopped", "failed", "broken off", "damaged"]
STYLES: dict[State, str] = {
    "running": "bold green",
    "abandoned": "bold red",
    "finished": "bold green",
    "stopped": "bold yellow",
    "failed": "bold red",
    "broken off": "bold yellow",
    "damaged": "bold red",
}


class RunStatus(Struct, frozen=True, kw_only=True):
    """What `status` prints.

    Attributes:
        state: `running` while an orchestrator works on it, `abandoned` where processes go on without one. Else how it
            ended: `finished`, `stopped` by somebody, `failed`, or `broken off` where its orchestrator was killed; or
            `damaged` where what it was told is not all there.
        ended: when, in seconds since 1970; None where nobody wrote that down.
        reason: why it did before all was done, in a sentence.
        is_finished: whether all that was to be done in it is done.
        phase: what the agent did last; None before its first word.
        progress: how far it was then; of a run that has ended, no news.
        restarts: how often each process was started again that failed.
    """

    run: str
    state: State
    ended: float | None
    reason: str | None
    phase: str | None
    progress: Progress | None
    summary: Summary | None
    evaluation: Evaluation | None
    workers: tuple[Health, ...]
    restarts: dict[str, int]
    is_finished: bool
    has_weights: bool
    has_evaluation: bool


def run_status(run: RunDirectory, patience: float = PATIENCE) -> RunStatus:
    """Look at a run without disturbing it."""
    processes = run.processes()
    alive = [process for process in processes if is_alive(process)]
    progress, restarts = run.progress(), count_restarts(run.restarts())
    standing = _standing(run, goes_on=bool(alive))
    return RunStatus(
        run=str(run.path),
        state=standing.state,
        ended=standing.ended,
        reason=standing.reason,
        phase=progress.phase if progress else None,
        progress=progress,
        summary=run.summary(),
        evaluation=run.evaluation(),
        workers=_health_of(processes, restarts, patience),
        restarts=restarts,
        is_finished=standing.is_finished,
        has_weights=run.weights_path.is_file(),
        has_evaluation=run.evaluation_path.is_file(),
    )


class _Standing(NamedTuple):
    state: State
    is_finished: bool = False
    ended: float | None = None
    reason: str | None = None


def _standing(run: RunDirectory, *, goes_on: bool) -> _Standing:
    """How a run is, by its own records first: that its processes run not says nothing of what it came to."""
    try:
        run.told()
        finished = run.is_finished()
    except (InvalidConfig, DamagedRecord) as error:
        return _Standing("damaged", reason=str(error))
    if run.is_busy():
        return _Standing("running", finished)
    if goes_on:
        return _Standing("abandoned", finished)
    ending, progress = run.ending(), run.progress()
    if finished:
        # Before endings were written down, the agent's last word was near it.
        ended = ending.time if ending else progress.time if progress else None
        return _Standing("finished", finished, ended)
    if ending is None or ending.outcome == "finished":
        return _Standing("broken off", ended=progress.time if progress else None)
    return _Standing(ending.outcome, ended=ending.time, reason=ending.reason)


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


def status_view(status: RunStatus) -> RenderableType:
    """The status as a few lines."""
    return Group(*_lines(status))


def _lines(status: RunStatus) -> Iterator[RenderableType]:
    when = f"  {datetime.fromtimestamp(status.ended):%Y-%m-%d %H:%M:%S}" if status.ended is not None else ""
    yield Text.assemble(status.run, "  ", (status.state, STYLES[status.state]), when)
    if status.reason:
        yield Text(status.reason)
    if status.state == "finished":
        yield from _results(status)
    else:
        yield from _under_way(status)
    if status.workers and status.state not in ("finished", "stopped", "failed"):
        yield workers_table(status.workers)


def _results(status: RunStatus) -> Iterator[RenderableType]:
    """What a run came to that is done."""
    if status.summary is not None:
        yield Text(trained_words(status.summary))
    if status.evaluation is not None and status.evaluation.scores:
        yield Text(score_words(status.evaluation.scores[0]))
    yield Text(f"its files are in {Path(status.run).resolve()}", "dim")


def _under_way(status: RunStatus) -> Iterator[RenderableType]:
    """How far a run is that is not done, and how to go on with it."""
    resume = f"go on with it by 'orchestrator resume {status.run}'"
    if status.state == "abandoned":
        yield Text(f"its orchestrator is gone, and some of its processes go on for a while: {resume}")
    elif status.state in ("stopped", "failed", "broken off"):
        yield Text(f"it has not come to its end: {resume}")
    if status.progress is None:
        yield Text("its agent has not said anything yet")
    elif status.state in ("running", "abandoned"):
        yield Text("   ".join(figures(status.progress)))
    else:
        yield Text(f"it came to {status.progress.phase} {status.progress.step}/{status.progress.steps}")
    made = [name for name, there in (("weights", status.has_weights), ("evaluation", status.has_evaluation)) if there]
    yield Text(f"made so far: {', '.join(made) or 'no weights yet'}", "dim")


def score_words(score: PolicyScore) -> str:
    """How a policy flew, in a line."""
    return (
        f"{score.policy} on {score.episodes} test flights: return {score.total_reward.mean:.1f}, "
        f"uncertainty {score.uncertainty.mean:.2f}, success {score.success.mean:.0%}, crash {score.crash.mean:.0%}"
    )
