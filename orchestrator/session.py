"""A session: starts workers and agents under a supervisor, waits for them, and displays their health."""

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from orchestrator.hosting.remote_workers import NO_REMOTE_WORKERS, RemoteWorkers
from orchestrator.monitoring.live_display import Display, FrameCount, Snapshot
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.log_warnings import LogWarnings
from orchestrator.supervision.supervised_process import IsDone
from orchestrator.supervision.supervisor import Supervisor
from protocol.errors import DeadlineExceeded, Interrupted
from protocol.records import Progress
from protocol.system.stop_request import StopRequest

POLL = 0.05
"""Seconds between two polls of the processes."""
SHOW = 0.2
"""Seconds between two updates of the display."""


class Session:
    """Starts processes and waits for them, while the supervisor polls them and a display shows their health.

    Args:
        progress: the agent's last progress; None before the first.
        log: the orchestrator's own log, whose warnings are displayed as well.
        remote_workers: workers of the run that are not supervised here.
    """

    def __init__(
        self,
        fleet: Fleet,
        supervisor: Supervisor,
        display: Display,
        stop: StopRequest,
        progress: Callable[[], Progress | None] = lambda: None,
        log: Path | None = None,
        remote_workers: RemoteWorkers = NO_REMOTE_WORKERS,
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
        self._earlier_progress = progress()
        self._shown = -math.inf
        self._warnings = LogWarnings()
        if log is not None:
            self._warnings.follow_file("orchestrator", log, log.stat().st_size if log.exists() else 0)

    def start(self, launch: Launch, is_done: IsDone | None = None) -> None:
        """Start a process, or adopt its orphan; errors as `Supervisor.start`."""
        self._warnings.follow(self._supervisor.start(launch, is_done))

    def start_workers(self, launches: Sequence[Launch]) -> None:
        """Start workers in parallel and wait until each reports that it is ready.

        Raises:
            ProcessFailed, DeadlineExceeded, VersionMismatch, WrongRole: see `Supervisor.poll`.
            Interrupted: the command was asked to stop.
        """
        for launch in launches:
            self.start(launch)
        while waiting := [launch.name for launch in launches if not self._supervisor.is_ready(launch.name)]:
            self._stop.check()
            self._supervisor.poll()
            self._show(f"waiting for {', '.join(waiting)}")
            self._stop.sleep(POLL)

    def wait_for_remote_workers(self, startup: float) -> None:
        """Wait until the remote workers are ready, at most `startup` seconds.

        Raises:
            DeadlineExceeded: they were not.
            NotPermitted, VersionMismatch, WrongRole: the host refuses us.
            ProcessFailed, Interrupted: as `start_workers`.
        """
        deadline = self._clock() + startup
        while waiting := self._remote_workers.waits_for():
            if self._clock() >= deadline:
                raise DeadlineExceeded(
                    f"waited {startup:g} s (timeouts.startup) in vain for {waiting}{self._remote_states()}"
                )
            self._stop.check()
            self._supervisor.poll()
            self._show(f"waiting for {waiting}")
            self._stop.sleep(POLL)

    def run(self, launch: Launch, activity: str, is_done: IsDone) -> None:
        """Run an agent until its work is done; it may have been started before.

        Raises:
            ProcessFailed, DeadlineExceeded, VersionMismatch, WrongRole: see `Supervisor.poll`.
            Interrupted: the command was asked to stop; the agent has written what it had learned.
        """
        self._earlier_progress = self._progress()
        if not self._supervisor.supervises(launch.name):
            self.start(launch, is_done)
        while not self._supervisor.is_over(launch.name):
            if self._stop.is_asked:
                self._show(f"stopping {launch.name}", at_once=True)
                self._fleet.stop_agents()
                raise Interrupted(f"{activity} was stopped on request")
            self._remote_workers.check()
            self._supervisor.poll()
            self._show(activity)
            self._stop.sleep(POLL)
        self._supervisor.release(launch.name)
        self._show(activity, at_once=True)

    def check_workers(self, activity: str, progress: FrameCount | None = None) -> None:
        """Poll the workers once, for a caller that waits for their replies; errors as `start_workers`."""
        self._stop.check()
        self._remote_workers.check()
        self._supervisor.poll()
        self._show(activity, progress=progress)

    def _show(self, activity: str, *, at_once: bool = False, progress: FrameCount | None = None) -> None:
        if not at_once and self._clock() - self._shown < SHOW:
            return
        self._shown = self._clock()
        self._display.show(
            Snapshot(
                activity=activity,
                elapsed=self._clock() - self._began,
                progress=progress or self._new_progress(),
                workers=(*self._remote_workers.health(), *self._supervisor.health()),
                warning=self._warnings.last(),
            )
        )

    def _remote_states(self) -> str:
        there = ", ".join(f"{one.name} is {one.state}" for one in self._remote_workers.health())
        return f" ({there})" if there else ""

    def _new_progress(self) -> Progress | None:
        """The progress of the present activity; None while the last record is an earlier one's."""
        progress = self._progress()
        return progress if progress != self._earlier_progress else None
