"""A hold on a running process: our own child, or one that an earlier orchestrator started."""

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
    """What can be asked of a process, whoever started it."""

    @property
    def pid(self) -> int:
        """Its number."""
        ...

    @property
    def started_at(self) -> ProcessStart | None:
        """When it was started: the same for whoever asks, whatever is done to clocks; None where it ended at once."""
        ...

    @property
    def started(self) -> float:
        """Its creation in seconds since 1970 as the clock was set when it was looked at; for people."""
        ...

    @property
    def is_running(self) -> bool:
        """Whether it still runs; false also for one that has ended and is not yet buried."""
        ...

    @property
    def exit_code(self) -> int | None:
        """Negative where a signal ended it; None while it runs, and for ever where only its parent is told."""
        ...

    def wait(self, seconds: float) -> bool:
        """Whether it ended within `seconds`."""
        ...


class Child:
    """A process that we started, at the head of a process group of its own.

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


class Foundling:
    """A process that is not our child: the system tells its exit code to its parent alone."""

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
            # A process of the same number that came later is not taken for it.
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
    """Whether nothing of a process is left but its entry in the system's table.

    The system shows a killed one as a zombie once its first thread has ended. Until its last thread has, which takes a
    second on a busy machine, it holds its sockets and locks, and who is started in its place finds them in use.

    Raises:
        psutil.NoSuchProcess: not even that is left.
    """
    return process.status() == psutil.STATUS_ZOMBIE and process.num_threads() <= 1


def is_stopped(process: ProcessHandle) -> bool:
    """Whether the system lets it stand still, as after SIGSTOP; one that a debugger holds is not meant."""
    try:
        return psutil.Process(process.pid).status() == psutil.STATUS_STOPPED
    except psutil.NoSuchProcess:
        return False


def send_signal(process: ProcessHandle, number: signal.Signals) -> None:
    """Signal a process, if it runs."""
    if process.is_running:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, number)


def kill_group(process: ProcessHandle) -> None:
    """SIGKILL to a process and whatever it started."""
    if process.is_running:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def creation_time(pid: int) -> float:
    """When a process was created, in seconds since 1970 as the clock is set now, right to a second; 0 for none."""
    try:
        return psutil.Process(pid).create_time()
    except psutil.NoSuchProcess:
        return 0.0
