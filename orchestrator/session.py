"""A command at work with a fleet: waits for processes, watches them, and shows how they are."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from types import TracebackType

from orchestrator.errors import Interrupted, ProcessFailed
from orchestrator.fleet import Fleet
from orchestrator.heartbeat import Health, Heartbeat
from orchestrator.launch import Launch
from orchestrator.live_display import Display, Snapshot
from orchestrator.log_warnings import LogWarnings
from orchestrator.stop_request import StopRequest
from orchestrator.worker_process import WorkerProcess
from protocol.errors import DeadlineExceeded
from protocol.messages import State
from protocol.records import Progress
from protocol.timeouts import Timeouts

TICK = 0.2
"""Seconds between two looks at the processes."""
LAST_BREATH = 1.0
"""Seconds that a killed process may take to be gone."""


class Session:
    """Starts processes in a fleet and waits for them, while a display shows the fleet's health.

    Args:
        progress: how far the agent is; None before its first word.
    """

    def __init__(
        self,
        fleet: Fleet,
        display: Display,
        stop: StopRequest,
        timeouts: Timeouts,
        progress: Callable[[], Progress | None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self._fleet = fleet
        self._display = display
        self._stop = stop
        self._timeouts = timeouts
        self._progress = progress
        self._clock = clock
        self._wall_clock = wall_clock
        self._began = clock()
        self._activity_began = wall_clock()
        self._closing = ExitStack()
        self._heartbeats: dict[str, Heartbeat] = {}
        self._warnings = LogWarnings()

    def __enter__(self) -> "Session":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._closing.close()

    def start_workers(self, launches: Sequence[Launch]) -> None:
        """Start workers side by side and wait until each says that it can work.

        Raises:
            ProcessFailed: one ended instead.
            DeadlineExceeded: one was not ready when the startup clock ran out.
            VersionMismatch, WrongRole: it is no worker to talk to.
            Interrupted: somebody asked to stop.
        """
        workers = [self._start(launch) for launch in launches]
        deadline = self._clock() + self._timeouts.startup
        while waiting := [worker for worker in workers if not self._heartbeats[worker.name].is_ready]:
            self._stop.check()
            self._fleet.require_workers()
            if self._clock() >= deadline:
                raise DeadlineExceeded(_not_ready(waiting, self._timeouts.startup))
            for worker in waiting:
                self._heartbeats[worker.name].check()
            self._show(f"waiting for {', '.join(worker.name for worker in waiting)}")
            self._stop.nap(TICK)

    def run(self, launch: Launch, activity: str) -> None:
        """Start an agent and wait for its end.

        Raises:
            ProcessFailed: it, or a worker that it needs, failed.
            Interrupted: somebody asked to stop; the agent has written what it had.
        """
        self._activity_began = self._wall_clock()
        agent = self._start(launch)
        while agent.is_running:
            if self._stop.is_asked:
                self._show(f"stopping {agent.name}")
                self._fleet.stop_agents()
                raise Interrupted(f"{activity} was stopped on request")
            self._fleet.require_workers()
            self._show(activity)
            self._stop.nap(TICK, until=lambda: not agent.is_running)
        self._heartbeats.pop(launch.name)
        self._show(activity)
        if agent.exit_code != 0:
            # An agent that lost a worker fails right after it: the end of the worker, if it is gone yet, is the reason.
            self._stop.nap(LAST_BREATH, until=lambda: any(not worker.is_running for worker in self._fleet.workers))
            self._fleet.require_workers()
            raise ProcessFailed(agent.obituary())

    def _start(self, launch: Launch) -> WorkerProcess:
        process = self._fleet.start(launch)
        record = next(record for record in self._fleet.records() if record.name == launch.name)
        heartbeat = Heartbeat(record, self._timeouts, unheard=State.STARTING.value)
        self._heartbeats[launch.name] = self._closing.enter_context(heartbeat)
        self._warnings.follow(process)
        return process

    def _show(self, activity: str) -> None:
        self._display.show(
            Snapshot(
                activity=activity,
                elapsed=self._clock() - self._began,
                progress=self._news(),
                workers=tuple(self._health()),
                warning=self._warnings.last(),
            )
        )

    def _news(self) -> Progress | None:
        """How far the present activity is; what an earlier one said last is no news."""
        progress = self._progress()
        return progress if progress is not None and progress.time >= self._activity_began else None

    def _health(self) -> Iterator[Health]:
        return (heartbeat.beat() for heartbeat in self._heartbeats.values())


def _not_ready(waiting: Sequence[WorkerProcess], startup: float) -> str:
    names = ", ".join(worker.name for worker in waiting)
    words = waiting[0].last_words()
    said = f"; {waiting[0].name} said last: {words}" if words else ""
    return f"{names} did not get ready within {startup:g} s{said} (log: {waiting[0].log})"
