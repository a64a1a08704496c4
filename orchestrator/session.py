"""A command at work with a supervisor: waits for workers, has an agent work, and shows how they are."""

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from orchestrator.hosting.remote_workers import NOBODY_ELSEWHERE, RemoteWorkers
from orchestrator.monitoring.live_display import Display, FrameCount, Snapshot
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.log_warnings import LogWarnings
from orchestrator.supervision.supervised_process import IsDone
from orchestrator.supervision.supervisor import Supervisor
from protocol.errors import DeadlineExceeded, Interrupted
from protocol.records import Progress
from protocol.system.stop_request import StopRequest

LOOK = 0.05
"""Seconds between two looks at the processes."""
SHOW = 0.2
"""Seconds between two pictures for people."""


class Session:
    """Starts processes and waits for them, while the supervisor looks after them and a display shows their health.

    Args:
        progress: how far the agent is; None before its first word.
        log: the orchestrator's own, whose warnings are shown as well.
        remote_workers: who works for the run and is none of the supervisor's.
    """

    def __init__(
        self,
        fleet: Fleet,
        supervisor: Supervisor,
        display: Display,
        stop: StopRequest,
        progress: Callable[[], Progress | None] = lambda: None,
        log: Path | None = None,
        remote_workers: RemoteWorkers = NOBODY_ELSEWHERE,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._fleet = fleet
        self._supervisor = supervisor
        self._display = display
        self._stop = stop
        self._progress = progress
        self._remote_workers = remote_workers
        self._clock = clock
        self._began = clock()
        self._said_before = progress()
        self._shown = -math.inf
        self._warnings = LogWarnings()
        if log is not None:
            self._warnings.follow_file("orchestrator", log, log.stat().st_size if log.exists() else 0)

    def start(self, launch: Launch, is_done: IsDone | None = None) -> None:
        """Start a process, or take up the one that was left behind, and go on; errors as `Supervisor.start`."""
        self._warnings.follow(self._supervisor.start(launch, is_done))

    def start_workers(self, launches: Sequence[Launch]) -> None:
        """Start workers side by side and wait until each says that it can work.

        Raises:
            ProcessFailed, DeadlineExceeded, VersionMismatch, WrongRole: see `Supervisor.look`.
            Interrupted: somebody asked to stop.
        """
        for launch in launches:
            self.start(launch)
        while waiting := [launch.name for launch in launches if not self._supervisor.is_ready(launch.name)]:
            self._stop.check()
            self._supervisor.look()
            self._show(f"waiting for {', '.join(waiting)}")
            self._stop.sleep(LOOK)

    def wait_for_others(self, startup: float) -> None:
        """Wait until those who are elsewhere can work, `startup` seconds in all.

        Raises:
            DeadlineExceeded: they could not.
            NotPermitted, VersionMismatch, WrongRole: they won't work with us.
            ProcessFailed, Interrupted: as `start_workers`.
        """
        deadline = self._clock() + startup
        while waiting := self._remote_workers.waits_for():
            if self._clock() >= deadline:
                raise DeadlineExceeded(f"waited {startup:g} s (timeouts.startup) in vain for {waiting}{self._others()}")
            self._stop.check()
            self._supervisor.look()
            self._show(f"waiting for {waiting}")
            self._stop.sleep(LOOK)

    def run(self, launch: Launch, activity: str, is_done: IsDone) -> None:
        """Have an agent work until its work is done; it may have been started before.

        Raises:
            ProcessFailed, DeadlineExceeded, VersionMismatch, WrongRole: see `Supervisor.look`.
            Interrupted: somebody asked to stop; the agent has written what it had.
        """
        self._said_before = self._progress()
        if not self._supervisor.cares_for(launch.name):
            self.start(launch, is_done)
        while not self._supervisor.is_over(launch.name):
            if self._stop.is_asked:
                self._show(f"stopping {launch.name}", at_once=True)
                self._fleet.stop_agents()
                raise Interrupted(f"{activity} was stopped on request")
            self._remote_workers.check()
            self._supervisor.look()
            self._show(activity)
            self._stop.sleep(LOOK)
        self._supervisor.release(launch.name)
        self._show(activity, at_once=True)

    def attend(self, activity: str, progress: FrameCount | None = None) -> None:
        """Look after the workers once, while somebody waits for what they answer; errors as `start_workers`."""
        self._stop.check()
        self._remote_workers.check()
        self._supervisor.look()
        self._show(activity, progress=progress)

    def _show(self, activity: str, *, at_once: bool = False, progress: FrameCount | None = None) -> None:
        if not at_once and self._clock() - self._shown < SHOW:
            return
        self._shown = self._clock()
        self._display.show(
            Snapshot(
                activity=activity,
                elapsed=self._clock() - self._began,
                progress=progress or self._news(),
                workers=(*self._remote_workers.health(), *self._supervisor.health()),
                warning=self._warnings.last(),
            )
        )

    def _others(self) -> str:
        there = ", ".join(f"{one.name} is {one.state}" for one in self._remote_workers.health())
        return f" ({there})" if there else ""

    def _news(self) -> Progress | None:
        """How far the present activity is; what an earlier one said last is no news."""
        progress = self._progress()
        return progress if progress != self._said_before else None
