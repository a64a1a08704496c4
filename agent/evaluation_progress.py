"""How far an evaluation is, for the records of its run."""

from collections.abc import Callable

from agent.checkpointing.journal import Journal
from agent.logbook import PROGRESS_EVERY, Clocks
from agent.throughput import Throughput
from protocol.records import Progress


class EvaluationStopped(Exception):
    """A stop was requested before the last flight was over."""


class EvaluationProgress:
    """Records how far an evaluation is, and stops it on request."""

    def __init__(self, journal: Journal, steps: int, clocks: Clocks, stop: Callable[[], bool]) -> None:
        self._journal = journal
        self._steps = steps
        self._clocks = clocks
        self._stop = stop
        self._step = 0
        self._throughput = Throughput(clocks.steady)
        self._written = clocks.steady()

    def __call__(self, steps: int) -> None:
        """Count `steps` more environment steps."""
        if self._stop():
            raise EvaluationStopped
        self._step += steps
        self._throughput.reached(self._step)
        if self._clocks.steady() - self._written >= PROGRESS_EVERY:
            self._written = self._clocks.steady()
            self._journal.progress(
                Progress(
                    time=self._clocks.wall(),
                    phase="evaluation",
                    step=self._step,
                    steps=self._steps,
                    episodes=0,
                    steps_per_second=self._throughput.steps_per_second,
                )
            )
