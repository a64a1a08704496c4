"""One child process of a run, from its start to its end."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path

import psutil

from orchestrator.errors import ProcessFailed
from orchestrator.json_lines import last_lines
from orchestrator.launch import Launch
from orchestrator.log_line import ERRORS, parse_log_line

LONGEST_QUOTE = 400


class WorkerProcess:
    """A process that was started from a `Launch`; the same launch can be started again.

    It leads a process group of its own: Ctrl-C in the terminal reaches the orchestrator alone, which then stops the
    others in order, and what a killed worker started itself is killed with it.

    Attributes:
        log: the file that takes its stdout and stderr.
        log_start: where its own lines begin there; an earlier process may have written to the same file.
        started: its creation, in seconds since the epoch.
    """

    def __init__(self, launch: Launch, log: Path, environment: Mapping[str, str]) -> None:
        self.launch = launch
        self.log = log
        self.log_start = log.stat().st_size if log.exists() else 0
        with log.open("ab") as errors:
            try:
                self._child = subprocess.Popen(
                    launch.command,
                    stdin=subprocess.DEVNULL,
                    stdout=errors,
                    stderr=errors,
                    env={**os.environ, **environment},
                    process_group=0,
                )
            except OSError as error:
                raise ProcessFailed(f"{launch.name} can't be started: {error}") from error
        self.started = _creation_time(self._child.pid)

    @property
    def name(self) -> str:
        """The launch's name."""
        return self.launch.name

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._child.pid

    @property
    def exit_code(self) -> int | None:
        """None while it runs; negative where a signal ended it."""
        return self._child.poll()

    @property
    def is_running(self) -> bool:
        """Whether it still runs."""
        return self.exit_code is None

    def ask_to_stop(self) -> None:
        """SIGTERM: workers finish what is in hand, the agent writes what it learned."""
        if self.is_running:
            self._child.terminate()

    def kill(self) -> None:
        """SIGKILL to the process and whatever it started."""
        if self.is_running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)

    def wait(self, seconds: float) -> bool:
        """Whether it ended within `seconds`."""
        try:
            self._child.wait(max(0.0, seconds))
        except subprocess.TimeoutExpired:
            return False
        return True

    def last_words(self) -> str | None:
        """The last error in this process's log, else its last line; None where it wrote nothing."""
        lines = [parse_log_line(line) for line in last_lines(self.log, self.log_start)]
        if not lines:
            return None
        words = next((line for line in lines if line.level in ERRORS), lines[0]).message
        return words if len(words) <= LONGEST_QUOTE else words[:LONGEST_QUOTE] + "…"

    def obituary(self) -> str:
        """How it ended, in a sentence with its last words and where to read on."""
        words = self.last_words()
        said = f": {words}" if words else " without a word"
        return f"{self.name} {ending(self.exit_code)}{said} (log: {self.log})"


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


def _creation_time(pid: int) -> float:
    try:
        return psutil.Process(pid).create_time()
    except psutil.NoSuchProcess:
        return 0.0
