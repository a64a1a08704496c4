"""A training by the real command, in processes of its own, that faults can be injected into."""

import contextlib
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType

from orchestrator.chaos.errors import NotRecovered, RehearsalFailed, RunEnded
from orchestrator.chaos.progress_log import ProgressLog
from orchestrator.chaos.scenarios.children import MARK, Children, end, marked
from orchestrator.run.json_lines import last_lines
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.socket_directory import sockets_of
from orchestrator.supervision.launch import module_command
from orchestrator.supervision.process_handle import creation_time
from orchestrator.supervision.worker_process import ending
from protocol.config import TimeoutsConfig
from protocol.failpoint import VARIABLE, Failpoints
from protocol.messages import Role
from protocol.system.process_start import process_start
from protocol.system.stop_request import StopRequest

POLL = 0.05
PATIENCE = 300.0
"""Seconds within which a run has to recover; a busy machine takes long to start a worker."""
STOP_PATIENCE = 60.0
LAST_WORDS = 2
"""Lines of the orchestrator's log that are quoted when it fails."""
KILL_PATIENCE = 10.0


class RehearsedRun:
    """A run and the orchestrator that works on it; all their processes have ended afterwards.

    Args:
        path: the run directory to make; logs and failpoints are beside it.
        show: called at each poll.
    """

    def __init__(
        self,
        config: Path,
        path: Path,
        timeouts: TimeoutsConfig,
        stop: StopRequest,
        show: Callable[["RehearsedRun"], None],
    ) -> None:
        self.directory = RunDirectory(path)
        self.timeouts = timeouts
        self.children = Children(self.directory)
        self.progress = ProgressLog(self.directory.progress_path)
        self.failpoints = Failpoints(_beside(path, ".failpoints"))
        self.resumes = 0
        self._config = config
        self._log = _beside(path, ".log")
        self._mark = str(path.resolve())
        self._stop = stop
        self._show = show
        self._orchestrator: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> "RehearsedRun":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def begin(self) -> None:
        """Start the training."""
        self._start("train", str(self._config), "--run", str(self.directory.path), "--no-evaluate")

    def resume(self) -> None:
        """Start a new orchestrator that resumes the run."""
        self.resumes += 1
        self._start("resume", str(self.directory.path))

    def signal_orchestrator(self, number: signal.Signals) -> None:
        """Stop, continue or kill the orchestrator; after a kill, the caller has to `resume`."""
        orchestrator = self._required()
        orchestrator.send_signal(number)
        if number is signal.SIGKILL:
            orchestrator.wait(KILL_PATIENCE)
            self._orchestrator = None

    @property
    def orchestrator_pid(self) -> int | None:
        """The orchestrator's process id; None where none works on the run."""
        return self._orchestrator.pid if self._orchestrator else None

    @property
    def is_over(self) -> bool:
        """Whether the orchestrator has finished the run."""
        return self._orchestrator is not None and self._orchestrator.poll() == 0

    def orchestrator_record(self) -> ProcessRecord:
        """A record of the orchestrator, like those of the other processes in `workers.json`.

        Raises:
            RunEnded: none works on the run.
        """
        orchestrator = self._required()
        if orchestrator.poll() is not None:
            raise RunEnded(f"the orchestrator of {self.directory.path} has ended")
        pid = orchestrator.pid
        return ProcessRecord(
            name=Role.ORCHESTRATOR.value,
            role=Role.ORCHESTRATOR,
            address=f"ipc://{sockets_of(self.directory.path)}/orchestrator",
            pid=pid,
            started=creation_time(pid),
            log=self._log.name,
            started_at=process_start(pid),
        )

    def now(self) -> float:
        """Seconds of the monotonic clock, which the agent's progress uses too."""
        return time.monotonic()

    def poll(self) -> None:
        """Read the run's progress and processes.

        Raises:
            RehearsalFailed: its orchestrator has failed.
            Interrupted: the command was asked to stop.
        """
        self._stop.check()
        self.progress.read()
        self.children.alive()
        self._show(self)
        code = self._orchestrator.poll() if self._orchestrator else None
        if code:
            raise RehearsalFailed(f"the orchestrator {ending(code)}: {self._last_words()} (log: {self._log})")

    def wait(self, until: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
        """Poll the run until a condition holds.

        Raises:
            NotRecovered: it did not in time.
            RunEnded: the run came to its end before.
            RehearsalFailed, Interrupted: as `poll` does.
        """
        deadline = time.monotonic() + patience
        while True:
            over = self.is_over
            self.poll()
            if until():
                return
            if over:
                raise RunEnded(f"the run ended before {what}")
            if time.monotonic() > deadline:
                raise NotRecovered(f"{what} has not come within {patience:g} s")
            self._stop.sleep(POLL)

    def sleep(self, seconds: float) -> None:
        """Poll the run for a number of seconds."""
        deadline = time.monotonic() + seconds
        self.wait(lambda: time.monotonic() >= deadline, "a pause was over")

    def finish(self) -> None:
        """Poll the run until its end, without a limit."""
        while not self.is_over:
            self.poll()
            self._stop.sleep(POLL)
        self.progress.read()

    def member(self, role: Role, chance: float) -> ProcessRecord:
        """One of the running processes of a role, chosen by `chance` in [0, 1); waits until there is one."""
        self.wait(lambda: bool(self.children.alive(role)), f"a process for {role.value} was there")
        alive = self.children.alive(role)
        return alive[int(chance * len(alive))]

    def successor(self, process: ProcessRecord) -> ProcessRecord | None:
        """The process that replaced a process, under the same name; None before that."""
        same_name = (other for other in self.children.alive() if other.name == process.name)
        return next((other for other in same_name if other.identity != process.identity), None)

    def stop_in_order(self) -> None:
        """Ask the orchestrator to stop the run, as Ctrl-C does."""
        if self._orchestrator is None or self._orchestrator.poll() is not None:
            return
        for number in (signal.SIGCONT, signal.SIGTERM):
            self._orchestrator.send_signal(number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._orchestrator.wait(STOP_PATIENCE)

    def close(self) -> None:
        """End every process of the rehearsal."""
        if self._orchestrator is not None:
            if self._orchestrator.poll() is None:
                self._orchestrator.kill()
            self._orchestrator.wait(KILL_PATIENCE)
        end(marked(self._mark), KILL_PATIENCE)
        for left in (sockets_of(self.directory.path), _beside(self.directory.path, ".failpoints")):
            shutil.rmtree(left, ignore_errors=True)

    def _start(self, *arguments: str) -> None:
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("ab") as log:
            self._orchestrator = subprocess.Popen(
                module_command("orchestrator", *arguments),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, **self._environment()},
                process_group=0,
            )

    def _environment(self) -> Mapping[str, str]:
        return {MARK: self._mark, VARIABLE: str(_beside(self.directory.path, ".failpoints").resolve())}

    def _required(self) -> subprocess.Popen[bytes]:
        if self._orchestrator is None:
            raise RunEnded(f"no orchestrator works on {self.directory.path}")
        return self._orchestrator

    def _last_words(self) -> str:
        # The line before the last is the error, the last line is how to continue.
        words = [line.decode(errors="replace") for line in last_lines(self._log)[:LAST_WORDS]]
        return "; ".join(reversed(words)) or "its log is empty"


def _beside(path: Path, suffix: str) -> Path:
    return path.with_name(path.name + suffix)
