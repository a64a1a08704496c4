"""A handle on a running process: our own child, or one that an earlier orchestrator started."""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import psutil

from protocol.system.process_start import ProcessStart, process_start

POLL = 0.02


class ProcessHandle(Protocol):
    """What both kinds of process tell."""

    @property
    def pid(self) -> int:
        """Its process id."""
        ...

    @property
    def started_at(self) -> ProcessStart | None:
        """When it was started, on a clock that is never set; None where it ended at once."""
        ...

    @property
    def started(self) -> float:
        """Its creation in seconds since 1970, by the wall clock as it was set when the handle was made; for display."""
        ...

    @property
    def is_running(self) -> bool:
        """Whether it still runs; false also for a zombie."""
        ...

    @property
    def exit_code(self) -> int | None:
        """Negative where a signal ended it; None while it runs, and always for a process that is not our child."""
        ...

    def wait(self, seconds: float) -> bool:
        """Whether it ended within `seconds`."""
        ...


class ChildProcess:
    """A process that we started, which leads a process group of its own.

    Raises:
        OSError: the system would not start it.
    """

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
        with log.open("ab") as output:
            self._child = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env={**os.environ, **environment},
                process_group=0,
            )
        self.pid = self._child.pid
        self.started_at = process_start(self.pid)
        self.started = creation_time(self.pid)

    @property
    def is_running(self) -> bool:
        """See `ProcessHandle`."""
        return self._child.poll() is None

    @property
    def exit_code(self) -> int | None:
        """See `ProcessHandle`."""
        return self._child.poll()

    def wait(self, seconds: float) -> bool:
        """See `ProcessHandle`."""
        try:
            self._child.wait(max(0.0, seconds))
        except subprocess.TimeoutExpired:
            return False
        return True


class AdoptedProcess:
    """A process that is not our child; the system tells its exit code to its parent alone."""

    exit_code = None

    def __init__(self, process: psutil.Process) -> None:
        self._process = process
        self.pid = process.pid
        self.started_at = process_start(process.pid)
        self.started = creation_time(process.pid)

    @property
    def is_running(self) -> bool:
        """See `ProcessHandle`."""
        try:
            # A later process may have the same id.
            return process_start(self.pid) == self.started_at is not None and not has_ended(self._process)
        except psutil.NoSuchProcess:
            return False

    def wait(self, seconds: float) -> bool:
        """See `ProcessHandle`."""
        deadline = time.monotonic() + seconds
        while self.is_running:
            if time.monotonic() >= deadline:
                return False
            time.sleep(POLL)
        return True


def has_ended(process: psutil.Process) -> bool:
    """Whether only a process's entry in the system's table is left.

    The system shows a killed process as a zombie once its first thread has ended. Until its last thread has ended,
    which takes a second on a busy machine, it holds its sockets and locks, and its successor finds them in use.

    Raises:
        psutil.NoSuchProcess: the entry is gone too.
    """
    return process.status() == psutil.STATUS_ZOMBIE and process.num_threads() <= 1


def is_stopped(process: ProcessHandle) -> bool:
    """Whether the system has stopped it, as after SIGSTOP; a process that a debugger holds does not count."""
    try:
        return psutil.Process(process.pid).status() == psutil.STATUS_STOPPED
    except psutil.NoSuchProcess:
        return False


def send_signal(process: ProcessHandle, number: signal.Signals) -> None:
    """Send a signal to a process, if it runs."""
    if process.is_running:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, number)


def kill_group(process: ProcessHandle) -> None:
    """Send SIGKILL to a process and to all that it started."""
    if process.is_running:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def creation_time(pid: int) -> float:
    """When a process was created, in seconds since 1970 by the wall clock now, exact to a second; 0 if it is gone."""
    try:
        return psutil.Process(pid).create_time()
    except psutil.NoSuchProcess:
        return 0.0
