"""The processes of a run: started together, watched together, and none left behind."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType

from orchestrator.errors import ProcessFailed
from orchestrator.launch import PROCESS_ENVIRONMENT, Launch
from orchestrator.run_directory import ProcessRecord
from orchestrator.stop_request import StopRequest
from orchestrator.worker_process import WorkerProcess
from protocol.messages import Role

AGENT_PATIENCE = 45.0
"""Seconds for the agent to finish its step and write what it learned."""
WORKER_PATIENCE = 10.0
KILL_PATIENCE = 5.0


class Fleet:
    """Starts processes from launches and ends them again, agents before the workers they depend on.

    Args:
        logs: directory of the processes' logs.
        stop: a second request to stop ends all patience.
        on_change: told of all processes whenever one was started.
    """

    def __init__(
        self,
        logs: Path,
        stop: StopRequest,
        on_change: Callable[[Sequence[ProcessRecord]], None] = lambda _: None,
        environment: Mapping[str, str] = PROCESS_ENVIRONMENT,
    ) -> None:
        self._logs = logs
        self._stop = stop
        self._on_change = on_change
        self._environment = environment
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
        """Start a process, in the place of an earlier one of the same name.

        Raises:
            ProcessFailed: the system would not start it, or one of this name runs.
        """
        earlier = self._processes.get(launch.name)
        if earlier is not None and earlier.is_running:
            raise ProcessFailed(f"{launch.name} runs already, as process {earlier.pid}")
        self._logs.mkdir(parents=True, exist_ok=True)
        process = WorkerProcess(launch, self._logs / f"{launch.name}.jsonl", self._environment)
        self._processes[launch.name] = process
        self._on_change(self.records())
        return process

    def records(self) -> tuple[ProcessRecord, ...]:
        """What `workers.json` says of each process."""
        return tuple(
            ProcessRecord(
                name=process.name,
                role=process.launch.role,
                address=process.launch.address,
                pid=process.pid,
                started=process.started,
                log=f"{self._logs.name}/{process.log.name}",
            )
            for process in self.processes
        )

    def require_workers(self) -> None:
        """Raise `ProcessFailed`, with the worker's last words, if a worker has ended."""
        for worker in self.workers:
            if not worker.is_running:
                raise ProcessFailed(worker.obituary())

    def stop(self) -> None:
        """End every process: the agents first, since they still need the workers to finish their step."""
        self.stop_agents()
        self._end(self.processes, WORKER_PATIENCE)

    def stop_agents(self) -> None:
        """Have the agents write what they learned and end."""
        self._end((process for process in self.processes if process.launch.role is Role.AGENT), AGENT_PATIENCE)

    def _end(self, processes: Iterable[WorkerProcess], patience: float) -> None:
        ending = [process for process in processes if process.is_running]
        for process in ending:
            process.ask_to_stop()
        deadline = time.monotonic() + patience
        while any(process.is_running for process in ending) and time.monotonic() < deadline:
            if self._stop.is_urgent:
                break
            self._stop.nap(0.1)
        for process in ending:
            process.kill()
        for process in ending:
            process.wait(KILL_PATIENCE)
