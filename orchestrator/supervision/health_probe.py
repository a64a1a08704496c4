"""Health probes: of a worker by ping, of an agent by its registration and its progress."""

from collections.abc import Callable
from typing import Protocol

from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.hang_detector import ProbeResult
from orchestrator.supervision.heartbeat import NOT_RUNNING, RUNNING, Health, Heartbeat
from orchestrator.supervision.registry import Registry
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.messages import Pong, State
from protocol.records import Progress
from protocol.timeouts import Timeouts


class HealthProbe(Protocol):
    """Finds out the state of one process; never waits for it."""

    def probe(self, *, waiting: bool, stopped: bool) -> ProbeResult:
        """The state of the process now.

        Args:
            waiting: whether a worker that the process needs is not ready.
            stopped: whether the system has stopped the process (SIGSTOP).

        Raises:
            VersionMismatch, WrongRole: it speaks another version, or serves another role.
        """
        ...

    def health(self) -> Health:
        """The health to display, as of the last `probe`."""
        ...

    def close(self) -> None:
        """Close the connection to the process."""
        ...


class WorkerProbe:
    """Probes a worker by ping."""

    def __init__(self, process: ProcessRecord, timeouts: Timeouts) -> None:
        self._heartbeat = Heartbeat(process, timeouts, unheard=State.STARTING.value)
        self._health = self._heartbeat.beat()

    @property
    def pong(self) -> Pong | None:
        """Its last answer; None before the first."""
        return self._heartbeat.pong

    def probe(self, *, waiting: bool, stopped: bool) -> ProbeResult:
        """See `HealthProbe`."""
        self._health = self._heartbeat.beat()
        self._heartbeat.check()
        ready, pong = self._heartbeat.is_ready, self._heartbeat.pong
        return ProbeResult(
            ready=ready,
            # While it imports and loads, Python may keep the thread that answers pings from running.
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
        """Ask the worker to answer its requests in hand, and end."""
        self._heartbeat.drain()

    def close(self) -> None:
        """See `HealthProbe`."""
        self._heartbeat.close()


class AgentProbe:
    """Probes an agent, which serves nothing, but registers at every heartbeat and records its progress."""

    def __init__(
        self, process: WorkerProcess, registry: Registry | None, progress: Callable[[], Progress | None]
    ) -> None:
        self._process = process
        self._registry = registry
        self._progress = progress
        self._said_before = progress()
        self._heard: float | None = None

    def probe(self, *, waiting: bool, stopped: bool) -> ProbeResult:
        """See `HealthProbe`."""
        process, progress = self._process, self._progress()
        if self._registry is not None:
            self._heard = self._registry.heard(process.name, process.pid) or self._heard
        begun = progress is not None and self._is_its_own(progress)
        return ProbeResult(
            ready=begun,
            # It registers before it has loaded its libraries; while it loads, Python may keep that thread from running.
            expected=begun and self._heard is not None,
            heard=self._heard,
            progress=progress.time if progress and begun else 0.0,
            busy=begun,
            waiting=waiting,
            stopped=stopped,
        )

    def _is_its_own(self, progress: Progress) -> bool:
        """Whether this agent wrote the record, and not an earlier process of the same name."""
        if progress.process is not None:
            return progress.process == self._process.started_at
        # An agent of an older version does not record which process it is.
        return progress != self._said_before

    def health(self) -> Health:
        """See `HealthProbe`."""
        return Health(name=self._process.name, role=self._process.launch.role, pid=self._process.pid, state=RUNNING)

    def close(self) -> None:
        """See `HealthProbe`."""


def ended(process: ProcessRecord) -> Health:
    """The health of a process that has ended."""
    return Health(name=process.name, role=process.role, pid=process.pid, state=NOT_RUNNING)
