"""How a run is right now, as its files and its processes tell."""

import shlex
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from datetime import datetime
from typing import Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace
from rich.console import Group, RenderableType
from rich.text import Text

from orchestrator.heartbeat import NOT_RUNNING, SILENT, Health, Heartbeat, is_alive
from orchestrator.live_display import duration, figures, workers_table
from orchestrator.restart import count_restarts
from orchestrator.run_directory import ProcessRecord, RunDirectory
from orchestrator.work_record import Work, all_work
from protocol.records import PolicyScore, Progress, Summary
from protocol.timeouts import Timeouts

PATIENCE = 2.0
"""Seconds to wait for the workers' answers."""
POLL = 0.05

State: TypeAlias = Literal["running", "abandoned", "finished", "stopped", "failed", "killed", "not running"]
_STYLES: Mapping[State, str] = {
    "running": "bold green",
    "abandoned": "bold red",
    "finished": "bold green",
    "stopped": "bold yellow",
    "failed": "bold red",
    "killed": "bold red",
    "not running": "bold yellow",
}


class RunStatus(Struct, frozen=True, kw_only=True):
    """What `status` prints.

    Attributes:
        state: `running` while an orchestrator works on it, and `abandoned` where processes go on without one. Else how
            it stands: `finished`, `stopped` on request, `failed`, `killed` with its orchestrator, or `not running`
            where that is not known: nobody has worked on it yet, or an earlier version did.
        reason: why it failed or was stopped; empty otherwise.
        ended: when it was last worked on, in seconds since 1970; None while somebody does, or where it is not known.
        seconds: that were worked on it until then, those before a kill not counted.
        phase: what the agent did last; None before its first word.
        progress: how far it came in that, as of `progress.time`.
        restarts: how often each process was started again that failed.
        result: how the trained policy flew; None before an evaluation.
        files: what it has made, relative to `run`.
    """

    run: str
    state: State
    reason: str
    ended: float | None
    seconds: float
    phase: str | None
    progress: Progress | None
    workers: tuple[Health, ...]
    restarts: dict[str, int]
    is_finished: bool
    has_weights: bool
    has_evaluation: bool
    result: PolicyScore | None
    summary: Summary | None
    files: tuple[str, ...]


def run_status(run: RunDirectory, patience: float = PATIENCE) -> RunStatus:
    """Look at a run without disturbing it; it needs no right to write."""
    processes = run.processes()
    alive = [process for process in processes if is_alive(process)]
    progress, restarts, evaluation = run.progress(), count_restarts(run.restarts()), run.evaluation()
    work = all_work(run.work_path)
    state = _state(run, work, is_busy=run.is_busy(), is_alive=bool(alive))
    goes_on = state in ("running", "abandoned")
    return RunStatus(
        run=str(run.path),
        state=state,
        reason=work[-1].reason if state in ("stopped", "failed") else "",
        ended=None if goes_on else _ended(work, progress) if state == "finished" else _last_heard(work, progress),
        seconds=sum(one.seconds for one in work if one.job != "evaluate"),
        phase=progress.phase if progress else None,
        progress=progress,
        workers=_health_of(processes, restarts, patience) if goes_on else tuple(map(_not_running, processes)),
        restarts=restarts,
        is_finished=run.is_finished(),
        has_weights=run.weights_path.is_file(),
        has_evaluation=run.evaluation_path.is_file(),
        result=evaluation.scores[0] if evaluation and evaluation.scores else None,
        summary=run.summary(),
        files=tuple(path.name for path in (run.weights_path, run.evaluation_path, run.logs) if path.exists()),
    )


def _state(run: RunDirectory, work: Sequence[Work], *, is_busy: bool, is_alive: bool) -> State:
    if is_busy:
        return "running"
    if is_alive:
        return "abandoned"
    if run.is_finished():
        return "finished"
    if not work:
        return "not running"
    ending = work[-1].ending
    # Who evaluates a run that is not finished yet has done no more than that.
    return "killed" if ending is None else "stopped" if ending == "done" else ending


def _ended(work: Sequence[Work], progress: Progress | None) -> float | None:
    """When it came to its end; evaluations that were flown again later don't count."""
    ends = [one.time for one in work if one.job != "evaluate" and one.ending == "done"]
    return max(ends, default=None) or _last_heard(work, progress)


def _last_heard(work: Sequence[Work], progress: Progress | None) -> float | None:
    """When it was last worked on, as far as that was written down."""
    heard = [one.time for one in work[-1:]] + ([progress.time] if progress else [])
    return max(heard, default=None)


def _not_running(process: ProcessRecord) -> Health:
    return Health(name=process.name, role=process.role, pid=process.pid, state=NOT_RUNNING)


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
    """The status as a few lines: what goes on with its processes, or how it stands and what can be done."""
    lines: list[RenderableType] = [Text.assemble(status.run, "  ", (status.state, _STYLES[status.state]))]
    if status.state in ("running", "abandoned"):
        lines += _at_work(status)
    else:
        lines += _at_rest(status)
    return Group(*lines)


def _at_work(status: RunStatus) -> Iterator[RenderableType]:
    if status.state == "abandoned":
        yield Text(f"its orchestrator is gone, and some of its processes go on for a while: {_resume(status)}")
    yield Text("   ".join(figures(status.progress)) if status.progress else "its agent has not said anything yet")
    made = [name for name, there in (("weights", status.has_weights), ("evaluation", status.has_evaluation)) if there]
    yield Text(f"made so far: {', '.join(made) or 'no weights yet'}", "dim")
    if status.workers:
        yield workers_table(status.workers)


def _at_rest(status: RunStatus) -> Iterator[RenderableType]:
    when = f" on {moment(status.ended)}" if status.ended is not None else ""
    took = f", after {duration(status.seconds)} of work" if status.seconds else ""
    match status.state:
        case "finished":
            yield Text(f"it has come to its end{when}{took}")
        case "stopped" | "failed":
            yield Text(f"it {'was ' if status.state == 'stopped' else ''}{status.state}{when}{took}: {status.reason}")
        case "killed":
            yield Text(f"its orchestrator was killed, or its machine went down; it was last heard of{when}")
        case _:
            heard = f"; it was last heard of{when}" if when else ""
            yield Text(f"it has not come to its end{heard}")
    yield from _outcome(status)
    if status.files:
        yield Text(f"its files: {', '.join(status.files)} in {status.run}", "dim")
    yield Text(_afterwards(status))


def _outcome(status: RunStatus) -> Iterator[Text]:
    """How far it came, in a line, and how the policy flew, in another."""
    summary, progress, score = status.summary, status.progress, status.result
    if summary is not None and summary.complete:
        yield Text(f"trained {summary.steps} steps in {duration(summary.seconds)}, {summary.episodes} episodes", "bold")
    elif progress is not None:
        yield Text(f"it came to step {progress.step} of {progress.steps} in its {progress.phase}", "bold")
    else:
        yield Text("its agent has not said anything yet")
    if score is not None:
        yield Text(
            f"policy '{score.policy}' over {score.episodes} flights: return {score.total_reward.mean:.1f}, "
            f"uncertainty {score.uncertainty.mean:.2f}, success {100 * score.success.mean:.0f}%, "
            f"crash {100 * score.crash.mean:.0f}%",
            "bold",
        )


def _afterwards(status: RunStatus) -> str:
    if status.is_finished:
        again = f"'orchestrator evaluate {shlex.quote(status.run)}' flies its evaluation again"
        return f"'orchestrator resume {shlex.quote(status.run)}' prints its report, {again}"
    return _resume(status)


def _resume(status: RunStatus) -> str:
    return f"go on with it by 'orchestrator resume {shlex.quote(status.run)}'"


def moment(seconds: float) -> str:
    """A time since 1970 by the clock on the wall here; as a number where no calendar has it."""
    try:
        return f"{datetime.fromtimestamp(seconds):%Y-%m-%d at %H:%M}"
    except (OverflowError, ValueError, OSError):
        return f"{seconds:g} s after 1970"
