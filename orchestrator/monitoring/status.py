"""The present state of a run, by its files and its processes."""

import shlex
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

from orchestrator.monitoring.live_display import figures, workers_table
from orchestrator.monitoring.report import trained_words
from orchestrator.run.ending import Ending
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.restart import count_restarts
from orchestrator.run.run_directory import RunDirectory
from orchestrator.supervision.heartbeat import SILENT, Health, Heartbeat, is_alive
from protocol.errors import DamagedRecord, InvalidConfig
from protocol.records import Evaluation, PolicyScore, Progress, Summary
from protocol.timeouts import Timeouts

PATIENCE = 2.0
"""Seconds to wait for the workers' answers."""
POLL = 0.05

State: TypeAlias = Literal["running", "abandoned", "finished", "stopped", "failed", "broken off", "damaged"]
_STYLES: Mapping[State, str] = {
    "running": "bold green",
    "abandoned": "bold red",
    "finished": "bold green",
    "stopped": "bold yellow",
    "failed": "bold red",
    "broken off": "bold yellow",
    "damaged": "bold red",
}


class RunStatus(Struct, frozen=True, kw_only=True):
    """The output of `status`.

    Attributes:
        state: `running` while an orchestrator works on it; `abandoned` while processes run without one; otherwise how
            it ended: `finished`, `stopped` on request, `failed`, or `broken off` where its orchestrator was killed; or
            `damaged` where its configuration, plan or versions are damaged.
        ended: when it ended, in seconds since 1970; None before that, or where it was not recorded.
        reason: why it was stopped or failed, in a sentence.
        is_finished: whether all that was planned is done.
        phase: the agent's last phase; None before its first progress.
        progress: the agent's last progress, as of `progress.time`.
        restarts: how often each process was restarted after a failure.
        files: the results that exist, relative to `run`.
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
    files: tuple[str, ...]


def run_status(run: RunDirectory, patience: float = PATIENCE) -> RunStatus:
    """Find out the state of a run, without any write to it."""
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
        files=tuple(path.name for path in (run.weights_path, run.evaluation_path, run.logs) if path.exists()),
    )


class _Standing(NamedTuple):
    state: State
    is_finished: bool = False
    ended: float | None = None
    reason: str | None = None


def _standing(run: RunDirectory, *, goes_on: bool) -> _Standing:
    """The state of a run, by its records first: whether its processes run does not tell how it ended."""
    try:
        run.whole_config()
        finished = run.is_finished()
    except (InvalidConfig, DamagedRecord) as error:
        return _Standing("damaged", reason=str(error))
    if run.is_busy():
        return _Standing("running", finished)
    if goes_on:
        return _Standing("abandoned", finished)
    ending = run.ending()
    if finished:
        return _Standing("finished", finished, _finished_at(ending, run.progress()))
    if ending is None or ending.outcome == "finished":
        return _Standing("broken off", ended=_last_heard(None, run.progress()))
    return _Standing(ending.outcome, ended=ending.time, reason=ending.reason)


def _finished_at(ending: Ending | None, progress: Progress | None) -> float | None:
    """When all was done: `evaluate` records no ending, nor did older versions."""
    if ending is not None and ending.outcome == "finished":
        return ending.time
    return _last_heard(ending, progress)


def _last_heard(ending: Ending | None, progress: Progress | None) -> float | None:
    return max((record.time for record in (ending, progress) if record is not None), default=None)


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
    """The status as a few lines: its processes while it runs; otherwise how it ended, and how to continue."""
    goes_on = status.state in ("running", "abandoned")
    return Group(
        Text.assemble(status.run, "  ", (status.state, _STYLES[status.state])),
        *(_at_work(status) if goes_on else _at_rest(status)),
    )


def _at_work(status: RunStatus) -> Iterator[RenderableType]:
    if status.state == "abandoned":
        yield Text(f"its orchestrator is gone, and some of its processes still run: {_resume(status)}")
    yield Text(
        "   ".join(figures(status.progress)) if status.progress else "its agent has not reported any progress yet"
    )
    made = [name for name, there in (("weights", status.has_weights), ("evaluation", status.has_evaluation)) if there]
    yield Text(f"made so far: {', '.join(made) or 'no weights yet'}", "dim")
    if status.workers:
        yield workers_table(status.workers)


def _at_rest(status: RunStatus) -> Iterator[RenderableType]:
    yield Text(_end(status))
    yield from _outcome(status)
    if status.files:
        yield Text(f"files: {', '.join(status.files)} in {Path(status.run).resolve()}", "dim")
    if status.is_finished:
        again = f"'orchestrator evaluate {shlex.quote(status.run)}' flies its evaluation again"
        yield Text(f"'orchestrator resume {shlex.quote(status.run)}' prints its report, {again}")
    elif status.state != "damaged":
        yield Text(f"the run is not finished: {_resume(status)}")


def _end(status: RunStatus) -> str:
    """When and why it ended, in a sentence."""
    when = f" on {moment(status.ended)}" if status.ended is not None else ""
    why = f": {status.reason}" if status.reason else ""
    match status.state:
        case "finished":
            return f"the run finished{when}"
        case "stopped":
            return f"the run was stopped{when}{why}"
        case "failed":
            return f"the run failed{when}{why}"
        case "damaged":
            return f"it can't be continued{why}"
        case _ if when or status.workers:
            heard = f"; it was last heard of{when}" if when else ""
            return f"its orchestrator was killed, or its machine went down{heard}"
        case _:
            return "no work on it has begun"


def _outcome(status: RunStatus) -> Iterator[Text]:
    """How far it came, and the score of the policy."""
    summary, progress, evaluation = status.summary, status.progress, status.evaluation
    if summary is not None and summary.complete:
        yield Text(trained_words(summary), "bold")
    elif progress is not None:
        yield Text(f"it reached step {progress.step} of {progress.steps} of its {progress.phase}", "bold")
    else:
        yield Text("its agent has not reported any progress yet")
    if evaluation is not None and evaluation.scores:
        yield Text(_score_words(evaluation.scores[0]), "bold")


def _score_words(score: PolicyScore) -> str:
    """The score of a policy, in a line."""
    return (
        f"policy '{score.policy}' over {score.episodes} flights: return {score.total_reward.mean:.1f}, "
        f"uncertainty {score.uncertainty.mean:.3g}, success {score.success.mean:.0%}, crash {score.crash.mean:.0%}"
    )


def _resume(status: RunStatus) -> str:
    return f"continue it by 'orchestrator resume {shlex.quote(status.run)}'"


def moment(seconds: float) -> str:
    """A time since 1970 as local date and time; as a number where it is out of the calendar's range."""
    try:
        return f"{datetime.fromtimestamp(seconds):%Y-%m-%d at %H:%M}"
    except (OverflowError, ValueError, OSError):
        return f"{seconds:g} s after 1970"
