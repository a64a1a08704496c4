"""Several trainings, some at a time, each by an `orchestrator train` of its own; what was begun is resumed."""

import contextlib
import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import psutil
from msgspec.structs import replace

from orchestrator.errors import ProcessFailed
from orchestrator.experiments.grid.variants import GridTraining
from orchestrator.experiments.workers import Rate
from orchestrator.monitoring.live_display import Display, Snapshot
from orchestrator.run.config_toml import plain_toml
from orchestrator.run.run_directory import RunDirectory
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT, module_command
from orchestrator.supervision.process_handle import ChildProcess
from protocol.artifact import whole_file
from protocol.system.exit_code import ExitCode
from protocol.system.stop_request import StopRequest

POLL = 0.5
"""Seconds between two polls of the processes."""

PATIENCE = 60.0
"""Seconds that a training gets to write what it has, before it is killed."""


class TrainingProcesses:
    """Trains what is left of an experiment, `jobs` at a time.

    Args:
        out: the directory of the experiment, which gets a configuration and a log for each training.
    """

    def __init__(
        self,
        out: Path,
        jobs: int,
        display: Display,
        stop: StopRequest,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._out = out
        self._jobs = jobs
        self._display = display
        self._stop = stop
        self._clock = clock
        self._running: dict[str, ChildProcess] = {}

    def train(self, trainings: Sequence[GridTraining]) -> None:
        """Train all; those that are finished are left as they are.

        Raises:
            ProcessFailed: a training failed; the others were stopped in order, and all can be resumed.
            Interrupted: the command was asked to stop; likewise.
        """
        left = [training for training in trainings if not _run_of(training).is_finished()]
        self._began = self._clock()
        rate = Rate(sum(_steps(one) for one in trainings), sum(map(_done, trainings)), self._clock)
        try:
            while left or self._running:
                self._stop.check()
                while left and len(self._running) < self._jobs:
                    self._start(left.pop(0))
                self._collect()
                self._show(trainings, rate)
                self._stop.sleep(POLL)
        finally:
            self._end()

    def _start(self, training: GridTraining) -> None:
        name = training.path.name
        config = self._out / f"{name}.toml"
        with whole_file(config) as aside:
            aside.write_bytes(plain_toml(training.config))
        command = module_command("orchestrator", "train", str(config), "--run", str(training.path), "--or-resume")
        self._running[name] = ChildProcess(command, self._log(name), PROCESS_ENVIRONMENT)

    def _collect(self) -> None:
        for name, process in list(self._running.items()):
            if process.is_running:
                continue
            del self._running[name]
            if process.exit_code != ExitCode.DONE:
                raise ProcessFailed(f"the training {name} ended with {process.exit_code}; see {self._log(name)}")

    def _show(self, trainings: Sequence[GridTraining], rate: Rate) -> None:
        done = sum(map(_done, trainings))
        rate.reach(done)
        finished = sum(_run_of(training).is_finished() for training in trainings)
        activity = f"training {', '.join(self._running) or 'nothing'} ({finished} of {len(trainings)} done)"
        self._display.show(
            Snapshot(activity=activity, elapsed=self._clock() - self._began, progress=replace(rate.count, unit="steps"))
        )

    def _end(self) -> None:
        """Ask all that run to stop, and wait until they have."""
        for process in self._running.values():
            _signal(process, signal.SIGINT)
        deadline = self._clock() + PATIENCE
        for process in self._running.values():
            if not process.wait(deadline - self._clock()):
                _signal(process, signal.SIGKILL)
        self._running.clear()

    def _log(self, name: str) -> Path:
        return self._out / f"{name}.log"


def _run_of(training: GridTraining) -> RunDirectory:
    return RunDirectory(training.path)


def _steps(training: GridTraining) -> int:
    return training.config.training.steps


def _done(training: GridTraining) -> int:
    """Environment steps of a training so far."""
    run = _run_of(training)
    if run.is_trained():
        return _steps(training)
    progress = run.progress()
    return progress.step if progress is not None and progress.phase == "training" else 0


def _signal(process: ChildProcess, number: signal.Signals) -> None:
    with contextlib.suppress(psutil.NoSuchProcess):
        psutil.Process(process.pid).send_signal(number)
