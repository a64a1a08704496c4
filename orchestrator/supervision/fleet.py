"""The processes of a run, started and ended together."""

import logging
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType

import psutil

from orchestrator.errors import ProcessFailed
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.socket_directory import make_private
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT, Launch
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.messages import Role
from protocol.system.stop_request import StopRequest

AGENT_PATIENCE = 45.0
"""Seconds for the agent to finish its step and write what it learned."""
WORKER_PATIENCE = 10.0
KILL_PATIENCE = 5.0
POLL = 0.1

_log = logging.getLogger(__name__)


class Fleet:
    """Starts processes from launches, and ends them: agents before the workers that they need.

    Args:
        logs: directory of the processes' logs.
        stop: after a second request to stop, processes are killed at once.
        on_change: called with all processes whenever one was started or adopted.
        sockets: the directory of their sockets, if it is ours; it is made again if it was removed meanwhile.
    """

    def __init__(
        self,
        logs: Path,
        stop: StopRequest,
        on_change: Callable[[Sequence[ProcessRecord]], None] = lambda _: None,
        environment: Mapping[str, str] = PROCESS_ENVIRONMENT,
        sockets: Path | None = None,
    ) -> None:
        self._logs = logs
        self._stop = stop
        self._on_change = on_change
        self._environment = environment
        self._sockets = sockets
        self._processes: dict[str, WorkerProcess] = {}

    def __enter__(self) -> "Fleet":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def processes(self) -> tuple[WorkerProcess, ...]:
        """Every process, in the order of their start."""
        return tuple(self._processes.values())

    @property
    def workers(self) -> tuple[WorkerProcess, ...]:
        """The processes that serve."""
        return tuple(process for process in self.processes if process.launch.address is not None)

    def start(self, launch: Launch) -> WorkerProcess:
        """Start a process, which replaces an earlier one of the same name.

        Raises:
            ProcessFailed: the system would not start it, or one of this name runs.
            RunError: the directory of its socket can't be made.
        """
        earlier = self._processes.get(launch.name)
        if earlier is not None and earlier.is_running:
            raise ProcessFailed(f"{launch.name} runs already, as process {earlier.pid}")
        self._logs.mkdir(parents=True, exist_ok=True)
        if self._sockets is not None:
            make_private(self._sockets)
        return self._enter(WorkerProcess.start(launch, self._log(launch), self._environment))

    def adopt(self, launch: Launch, found: psutil.Process, log_start: int) -> WorkerProcess:
        """Take over a process that an earlier orchestrator started from the same launch."""
        return self._enter(WorkerProcess.adopt(launch, found, self._log(launch), log_start))

    def records(self) -> tuple[ProcessRecord, ...]:
        """The records of all processes, for `workers.json`."""
        return tuple(
            ProcessRecord(
                name=process.name,
                role=process.launch.role,
                address=process.launch.address,
                pid=process.pid,
                started=process.started,
                log=f"{self._logs.name}/{process.log.name}",
                log_start=process.log_start,
                started_at=process.started_at,
            )
            for process in self.processes
        )

    def stop(self) -> None:
        """End every process: the agents first, since they still need the workers to finish their step."""
        self.stop_agents()
        end_processes(self.processes, WORKER_PATIENCE, self._stop)

    def stop_agents(self) -> None:
        """Have the agents write what they learned and end.

        Without all workers they get less time, since their step may never end.
        """
        agents = [process for process in self.processes if process.launch.role is Role.AGENT]
        finishes = all(worker.is_running for worker in self.workers)
        end_processes(agents, AGENT_PATIENCE if finishes else WORKER_PATIENCE, self._stop)

    def _log(self, launch: Launch) -> Path:
        return self._logs / f"{launch.name}.jsonl"

    def _enter(self, process: WorkerProcess) -> WorkerProcess:
        self._processes[process.name] = process
        try:
            self._on_change(self.records())
        except OSError as error:
            # A later orchestrator finds the process by its command line as well.
            _log.warning("workers.json can't be written: %s", error)
        return process


def end_processes(processes: Iterable[WorkerProcess], patience: float, stop: StopRequest) -> None:
    """Ask processes to end, and kill those that still run after `patience` seconds, or once `stop` is urgent."""
    ending = [process for process in processes if process.is_running]
    for process in ending:
        process.ask_to_stop()
    deadline = time.monotonic() + patience
    while any(process.is_running for process in ending) and time.monotonic() < deadline:
        if stop.is_urgent:
            break
        stop.sleep(POLL)
    for process in ending:
        process.kill()
    for process in ending:
        process.wait(KILL_PATIENCE)
