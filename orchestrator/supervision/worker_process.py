"""One process of a run, from its start to its end."""

import signal
from collections.abc import Mapping
from pathlib import Path

import psutil

from orchestrator.errors import ProcessFailed
from orchestrator.run.json_lines import last_lines
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.log_line import ERRORS, parse_log_line
from orchestrator.supervision.process_handle import (
    AdoptedProcess,
    ChildProcess,
    ProcessHandle,
    is_stopped,
    kill_group,
    send_signal,
)
from protocol.system.process_start import ProcessStart

LONGEST_QUOTE = 400


class WorkerProcess:
    """A process of a `Launch`, started or adopted; the same launch can be started again.

    It leads a process group of its own. So Ctrl-C in the terminal reaches the orchestrator alone, which stops the
    others in order, and a killed worker's own children are killed with it.

    Attributes:
        log: the file that its stdout and stderr go to.
        log_start: the byte where its own lines begin; an earlier process may have written to the same file.
    """

    def __init__(self, launch: Launch, handle: ProcessHandle, log: Path, log_start: int) -> None:
        self.launch = launch
        self.log = log
        self.log_start = log_start
        self._handle = handle

    @classmethod
    def start(cls, launch: Launch, log: Path, environment: Mapping[str, str]) -> "WorkerProcess":
        """Start it.

        Raises:
            ProcessFailed: the system would not.
        """
        log_start = log.stat().st_size if log.exists() else 0
        try:
            return cls(launch, ChildProcess(launch.command, log, environment), log, log_start)
        except OSError as error:
            raise ProcessFailed(f"{launch.name} can't be started: {error}") from error

    @classmethod
    def adopt(cls, launch: Launch, found: psutil.Process, log: Path, log_start: int) -> "WorkerProcess":
        """Take over a process that an earlier orchestrator has started."""
        return cls(launch, AdoptedProcess(found), log, log_start)

    @property
    def name(self) -> str:
        """The launch's name."""
        return self.launch.name

    @property
    def pid(self) -> int:
        """The process id."""
        return self._handle.pid

    @property
    def started_at(self) -> ProcessStart | None:
        """When it was started, which tells it from a later process with the same id."""
        return self._handle.started_at

    @property
    def started(self) -> float:
        """Its creation in seconds since 1970, by the wall clock as it was set when we started or adopted it."""
        return self._handle.started

    @property
    def exit_code(self) -> int | None:
        """None while it runs, and always for an adopted process; negative where a signal ended it."""
        return self._handle.exit_code

    @property
    def is_running(self) -> bool:
        """Whether it still runs."""
        return self._handle.is_running

    @property
    def is_stopped(self) -> bool:
        """Whether it is stopped (SIGSTOP)."""
        return is_stopped(self._handle)

    def ask_to_stop(self) -> None:
        """Send SIGTERM: a worker answers its requests in hand, the agent writes what it learned."""
        # SIGCONT first: the system delivers a signal to a stopped process through any of its threads once it continues,
        # and Python handles it only when the main thread wakes.
        send_signal(self._handle, signal.SIGCONT)
        send_signal(self._handle, signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL to the process and to all that it started."""
        kill_group(self._handle)

    def wait(self, seconds: float) -> bool:
        """Wait for its end; returns whether it came within `seconds`."""
        return self._handle.wait(seconds)

    def last_words(self) -> str | None:
        """The last error in this process's log, else its last line; None where it wrote nothing."""
        lines = [parse_log_line(line) for line in last_lines(self.log, self.log_start)]
        if not lines:
            return None
        words = next((line for line in lines if line.level in ERRORS), lines[0]).message
        return words if len(words) <= LONGEST_QUOTE else words[:LONGEST_QUOTE] + "…"

    def exit_reason(self) -> str:
        """How it ended, in a sentence with the last line and the path of its log."""
        end = "has ended" if self.exit_code is None and not self.is_running else ending(self.exit_code)
        return f"{self.name} {end}{self._quote()} (log: {self.log})"

    def _quote(self) -> str:
        if self.exit_code == -signal.SIGKILL:
            # A killed process logs no reason; its last line is about something else.
            return ""
        words = self.last_words()
        return f": {words}" if words else " without a word"


def ending(exit_code: int | None) -> str:
    """How a process ended, in words."""
    if exit_code is None:
        return "is running"
    if exit_code >= 0:
        return f"ended with exit code {exit_code}"
    try:
        return f"was killed by {signal.Signals(-exit_code).name}"
    except ValueError:
        return f"was killed by signal {-exit_code}"
