"""The processes of a run: those in `workers.json` that the system says are running."""

import contextlib
import os
import signal
from collections.abc import Iterable, Iterator

import psutil

from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.run_directory import RunDirectory
from orchestrator.supervision.heartbeat import is_alive
from protocol.messages import Role
from protocol.system.process_start import ProcessStart

MARK = "VANTAGE_REHEARSAL"
"""An environment variable of every process of a rehearsal, by which all of them are found at the end."""


class Children:
    """The processes that the orchestrator has started for a run."""

    def __init__(self, run: RunDirectory) -> None:
        self._run = run
        self._seen: dict[str, set[tuple[int, ProcessStart | float]]] = {}

    def alive(self, role: Role | None = None) -> tuple[ProcessRecord, ...]:
        """The running processes, of one role or of all."""
        return tuple(record for record in self._read() if role in (None, record.role) and is_alive(record))

    @property
    def restarts(self) -> dict[str, int]:
        """How often each was restarted, as far as the polls have seen."""
        return {name: len(processes) - 1 for name, processes in sorted(self._seen.items())}

    def _read(self) -> tuple[ProcessRecord, ...]:
        records = self._run.processes()
        for record in records:
            self._seen.setdefault(record.name, set()).add(record.identity)
        return records


def send(record: ProcessRecord, number: signal.Signals) -> None:
    """Send a signal to the recorded process, unless it has ended."""
    if is_alive(record):
        with contextlib.suppress(ProcessLookupError):
            os.kill(record.pid, number)


def marked(mark: str) -> Iterator[psutil.Process]:
    """Every process with the mark in its environment."""
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if process.pid != os.getpid() and process.environ().get(MARK) == mark:
                yield process


def end(processes: Iterable[psutil.Process], patience: float) -> None:
    """Kill processes, stopped ones too, and wait for their end."""
    ending = list(processes)
    for process in ending:
        with contextlib.suppress(psutil.Error):
            process.kill()
    psutil.wait_procs(ending, timeout=patience)
