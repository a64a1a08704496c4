"""A training that things happen to, and how long it takes to go on."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from orchestrator.chaos.comparison import compare
from orchestrator.chaos.progress_log import Mark, ProgressLog
from protocol.config_file import load_config
from tests.docker.recoveries import RECOVERIES
from tests.docker.waiting import wait


class Training(Protocol):
    """A run in containers."""

    config: Path

    def read_progress(self) -> ProgressLog: ...

    def run_directory(self) -> Path: ...


class UnderFire:
    """Plays faults on a training."""

    def __init__(self, training: Training) -> None:
        self._training = training
        settings = load_config(training.config)
        self._drones = settings.environment.num_envs
        self._steps = settings.training.prefill + settings.training.steps

    def suffer(self, what: str, fault: Callable[[], object]) -> None:
        """Play a fault and wait until the training is further than it was, with a step of all drones to spare.

        The time to recover begins when the fault has struck, or for one that lasts when it is over; how long it took to
        play it is noted besides.
        """
        assert not self._is_over(), f"the training was over before: {what}"
        began = time.monotonic()
        fault()
        struck = time.monotonic()
        reached = self._training.read_progress().reached(struck) + self._drones

        wait(lambda: self._first_beyond(reached, struck) is not None, f"recovery from: {what}")
        beyond = self._first_beyond(reached, struck)
        assert beyond is not None
        RECOVERIES.note(what, struck - began, beyond.time - struck)

    def compare(self, control_run: Path) -> None:
        """Fail unless the training came to the same as a control run: weights, episodes and replay journal."""
        rows = self._steps // self._drones
        found = compare(control_run, self._training.run_directory(), rows=rows, drones=self._drones)
        assert found.transitions == self._steps
        assert found.identical, found.differences

    def _is_over(self) -> bool:
        """Whether all steps are flown; what comes then is the evaluation, which counts anew."""
        return max((mark.step for mark in self._training.read_progress().marks), default=0) >= self._steps

    def _first_beyond(self, step: int, time: float) -> Mark | None:
        """The first line after `time` that tells of more than `step` steps. A stopped agent says `done` too."""
        assert not self._is_over(), "the training was over before it had recovered"
        marks = self._training.read_progress().marks
        return next((mark for mark in marks if mark.time > time and mark.step > step), None)
