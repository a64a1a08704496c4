"""The agent's own metrics. docs/metrics.md lists them."""

import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from prometheus_client import Histogram
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from protocol.records import Phase, Progress

_BUCKETS = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class TrainingMetrics(Collector):
    """The metrics of a training or an evaluation.

    Args:
        checkpoints: the directory of the run's checkpoints; it may be missing.
        updates: the learner's updates so far; None where nothing is learned.
        clock: a steady one.
        wall_clock: seconds since 1970, as files have them; asked once, for the checkpoint of an earlier process.
    """

    def __init__(
        self,
        checkpoints: Path,
        updates: Callable[[], int] | None,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self._updates = updates
        self._clock = clock
        age = checkpoint_age(checkpoints, wall_clock())
        self._written = None if age is None else clock() - age
        self._last: Progress | None = None
        self._steps: dict[Phase, int] = {}
        self._writing = Histogram(
            "vantage_checkpoint_duration_seconds", "Seconds to write a checkpoint", registry=None, buckets=_BUCKETS
        )

    @property
    def has_begun(self) -> bool:
        """Whether the agent has reported progress."""
        return self._last is not None

    def progress(self, record: Progress) -> None:
        """Take in how far the agent is."""
        if record.phase != "done":
            # Another dictionary each time: the thread that collects may be reading this one.
            self._steps = {**self._steps, record.phase: record.step}
        self._last = record

    @contextmanager
    def checkpoint(self) -> Generator[None]:
        """Measure the time of a checkpoint, unless it fails."""
        begun = time.perf_counter()
        yield
        self._writing.observe(time.perf_counter() - begun)
        self._written = self._clock()

    def collect(self) -> Iterable[Metric]:
        """The metrics as they are now."""
        steps = CounterMetricFamily("vantage_environment_steps", "Environment steps flown", labels=("phase",))
        for phase, step in self._steps.items():
            steps.add_metric((phase,), step)
        yield steps
        if self._updates is not None:
            yield CounterMetricFamily("vantage_updates", "Gradient updates of the learner", self._updates())
        if self._last is not None:
            yield from _of_progress(self._last)
        yield from self._writing.collect()
        if self._written is not None:
            age = self._clock() - self._written
            yield GaugeMetricFamily("vantage_checkpoint_age_seconds", "Seconds since the newest checkpoint", age)


def _of_progress(progress: Progress) -> Iterator[Metric]:
    yield CounterMetricFamily("vantage_episodes", "Finished flights", progress.episodes)
    yield GaugeMetricFamily("vantage_steps_per_second", "Environment steps a second", progress.steps_per_second)
    if progress.episode_return is not None:
        yield GaugeMetricFamily("vantage_episode_return", "Mean return of the last flights", progress.episode_return)
    if progress.uncertainty is not None:
        yield GaugeMetricFamily("vantage_uncertainty", "Mean uncertainty at their ends", progress.uncertainty)


def checkpoint_age(directory: Path, now: float) -> float | None:
    """Seconds since the newest checkpoint in a directory was written, by any process; None where there is none."""
    written: list[float] = []
    for path in directory.glob("step-*"):
        try:
            written.append(path.stat().st_mtime)
        except FileNotFoundError:
            # An old one is removed at any moment.
            continue
    return max(0.0, now - max(written)) if written else None
