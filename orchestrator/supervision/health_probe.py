"""What is known of a running process: a worker tells when it is pinged, an agent by registering and by its progress."""

from collections.abc import Callable
from typing import Protocol

from orchestrator.run.run_directory import ProcessRecord
from orchestrator.supervision.hang_detector import Vitals
from orchestrator.supervision.heartbeat import NOT_RUNNING, RUNNING, Health, Heartbeat
from orchestrator.supervision.registry import Registry
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.messages import Pong, State
from protocol.records import Progress
from protocol.timeouts import Timeouts


class HealthProbe(Protocol):
    """Takes what a process lets us know; never waits for it."""

    def vitals(self, *, waiting: bool, stopped: bool) -> Vitals:
        """What is known now.

        Args:
            waiting: what the process depends on does not work.
            stopped: the system lets it stand still.

        Raises:
            VersionMismatch, WrongRole: it is not one to talk to.
        """
        ...

    def health(self) -> Health:
        """For people, as of the last `vitals`."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class WorkerProbe:
    """A worker's: its answers to our pings."""

    def __init__(self, process: ProcessRecord, timeouts: Timeouts) -> None:
        self._heartbeat = Heartbeat(process, timeouts, unheard=State.STARTING.value)
        self._health = self._heartbeat.beat()

    @property
    def pong(self) -> Pong | None:
        """Its last answer; None before the first."""
        return self._heartbeat.pong

    def vitals(self, *, waiting: bool, stopped: bool) -> Vitals:
        """See `HealthProbe`."""
        self._health = self._heartbeat.beat()
        self._heartbeat.check()
        ready, pong = self._heartbeat.is_ready, self._heartbeat.pong
        return Vitals(
            ready=ready,
            # While it imports and loads, Python may well keep the thread that answers from running.
            expected=ready,
            heard=self._heartbeat.heard,
            progress=pong.progress if pong else 0.0,
            busy=pong is not None and pong.queue_depth > 0,
            waiting=waiting,
            stopped=stopped,
        )

    def health(self) -> Health:
        """See `HealthProbe`."""
        return self._health

    def drain(self) -> None:
        """Have it finish what is in hand and end."""
        self._heartbeat.drain()

    def close(self) -> None:
        """See `HealthProbe`."""
        self._heartbeat.close()


class AgentProbe:
    """An agent's: it serves nothing, but registers at every heartbeat and writes down how far it is."""

    def __init__(
        self, process: WorkerProcess, registry: Registry | None, progress: Callable[[], Progress | None]
    ) -> None:
        self._process = process
        self._registry = registry
        self._progress = progress
        self._said_before = progress()
        self._heard: float | None = None

    def vitals(self, *, waiting: bool, stopped: bool) -> Vitals:
        """See `HealthProbe`."""
        process, progress = self._process, self._progress()
        if self._registry is not None:
            self._heard = self._registry.heard(process.name, process.pid) or self._heard
        begun = progress is not None and self._is_its_own(progress)
        return Vitals(
            ready=begun,
            # It registers before it has loaded all of its libraries, in which Python may keep that thread from running.
            expected=begun and self._heard is not None,
            heard=self._heard,
            progress=progress.time if progress and begun else 0.0,
            busy=begun,
            waiting=waiting,
            stopped=stopped,
        )

    def _is_its_own(self, progress: Progress) -> bool:
        """Whether it was this agent who wrote it: what an earlier one wrote last says nothing of it."""
        if progress.process is not None:
            return progress.process == self._process.started_at
        # An agent of an older version does not say who it is.
        return progress != self._said_before

    def health(self) -> Health:
        """See `HealthProbe`."""
        return Health(name=self._process.name, role=self._process.launch.role, pid=self._process.pid, state=RUNNING)

    def close(self) -> None:
        """See `HealthProbe`."""


def ended(process: ProcessRecord) -> Health:
    """The health of a process that is gone."""
    return Health(name=process.name, role=process.role, pid=process.pid, state=NOT_RUNNING)
