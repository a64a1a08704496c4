"""The cost of writing checkpoints and of resuming from one, with replay memories of several sizes.

    python -m benchmarks.checkpointing

The memory and its journal are filled with made-up steps. Between two checkpoints come as many new steps as in a
training of the default configuration; the share is of the time of these steps in the loop, by its given throughput.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from msgspec import Struct
from rich.console import Console

from agent.checkpointing.append_only_file import AppendOnlyFile
from agent.checkpointing.checkpoint import REPLAY, Content, Grown
from agent.checkpointing.checkpoints import Checkpoints
from agent.checkpointing.replay_journal import ReplayJournal
from agent.checkpointing.weights import FILE_NAME, save_weights
from agent.environment.spaces import ACTION_SIZE, OBSERVATION_SIZE
from agent.learning.algorithms import make_learner
from agent.learning.learner import Learner, Transition
from benchmarks.machine import machine_kind
from protocol.config import RunConfig
from protocol.learner_config import LearnerConfig, SacConfig

_MIB = 1024**2


class Cost(Struct, frozen=True, kw_only=True):
    """Seconds, and bytes on the disk."""

    transitions: int
    checkpoints: list[float]
    resume: float
    checkpoint_bytes: int
    journal_bytes: int


def measure(directory: Path, transitions: int, checkpoints: int) -> Cost:
    """Fill a memory with `transitions`, write checkpoints as a training does, and resume from the last."""
    config = RunConfig(learner=LearnerConfig(sac=SacConfig(buffer_size=transitions)))
    with ReplayJournal(directory / REPLAY, config.environment.num_envs, OBSERVATION_SIZE) as journal:
        trial = _Trial(directory, config, journal)
        trial.fill(transitions)
        every = config.training.checkpoint_every
        seconds = [trial.checkpoint(transitions + (number + 1) * every) for number in range(checkpoints)]
    return Cost(
        transitions=transitions,
        checkpoints=seconds,
        resume=_seconds_of(lambda: resume(directory, config)),
        checkpoint_bytes=_size(max((directory / "checkpoints").iterdir())),
        journal_bytes=_size(directory / REPLAY),
    )


class _Trial:
    """A training whose steps are made up."""

    def __init__(self, directory: Path, config: RunConfig, journal: ReplayJournal) -> None:
        self._directory = directory
        self._config = config
        self._journal = journal
        self._learner = make_learner(config.learner, config.environment, seed=0)
        self._checkpoints = Checkpoints(directory / "checkpoints", config)
        self._episodes = AppendOnlyFile(directory / "episodes.jsonl")
        self._rng = np.random.default_rng(0)

    def fill(self, transitions: int) -> None:
        """Fill the memory and its journal."""
        self._fly(transitions)
        self._journal.sync()
        # Some updates, so that the optimisers have something to keep.
        self._learner.updates = transitions - self._config.learner.sac.batch_size - 8
        self._learner.learn()

    def checkpoint(self, step: int) -> float:
        """Fly up to the next checkpoint; returns the seconds to write it."""
        self._fly(self._config.training.checkpoint_every)
        return _seconds_of(lambda: self._write(step))

    def _fly(self, transitions: int) -> None:
        drones = self._config.environment.num_envs
        for _ in range(transitions // drones):
            transition = _made_up(self._rng, drones)
            self._learner.observe(transition)
            self._journal.append(transition)

    def _write(self, step: int) -> None:
        self._checkpoints.write(_content(self._learner, step), self._sync)
        save_weights(self._directory / FILE_NAME, self._learner.weights(), {})

    def _sync(self) -> Grown:
        self._episodes.sync()
        return Grown(episodes=self._episodes.mark, replay=self._journal.sync())


def resume(directory: Path, config: RunConfig) -> None:
    """Verify the files of the newest checkpoint, and fill a learner from it."""
    newest = Checkpoints(directory / "checkpoints", config).newest()
    if newest is None:
        return
    newest.require_grown(directory)
    learner = make_learner(config.learner, config.environment, seed=0)
    learner.load_weights(newest.weights())
    learner.restore(newest.state()["learner"])
    segments = newest.manifest.grown.replay
    with ReplayJournal(directory / REPLAY, config.environment.num_envs, OBSERVATION_SIZE, segments) as journal:
        learner.recall(journal.last(learner.memory_steps))


def _content(learner: Learner, step: int) -> Content:
    return Content(
        step=step,
        mean_return=None,
        weights=learner.weights(),
        about={},
        state={"learner": learner.state()},
        measured={},
    )


def _made_up(rng: np.random.Generator, drones: int) -> Transition:
    return Transition(
        observations=rng.random((drones, OBSERVATION_SIZE), np.float32),
        actions=rng.random((drones, ACTION_SIZE), np.float32),
        rewards=rng.random(drones),
        next_observations=rng.random((drones, OBSERVATION_SIZE), np.float32),
        terminated=np.zeros(drones, bool),
        truncated=np.zeros(drones, bool),
    )


def _seconds_of(work: Callable[[], None]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def _size(directory: Path) -> int:
    return sum(path.stat().st_size for path in directory.iterdir())


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.checkpointing", description=__doc__)
    parser.add_argument("--transitions", type=int, nargs="+", default=[100_000, 1_000_000])
    parser.add_argument("--checkpoints", type=int, default=40)
    parser.add_argument("--steps-per-second", type=float, default=13.0, help="of the training loop")
    parser.add_argument("--in", dest="directory", type=Path, help="a directory on the disk to measure")
    options = parser.parse_args()
    interval = RunConfig().training.checkpoint_every / options.steps_per_second
    console = Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}; a checkpoint each {interval:.1f} s")
    console.print(
        "| transitions | checkpoint, median ms | worst ms | share of training | at worst | to go on, s "
        "| checkpoint, MiB | journal, MiB |\n|---:|---:|---:|---:|---:|---:|---:|---:|"
    )
    for transitions in options.transitions:
        with tempfile.TemporaryDirectory(dir=options.directory) as directory:
            cost = measure(Path(directory), transitions, options.checkpoints)
        median, worst = statistics.median(cost.checkpoints), max(cost.checkpoints)
        console.print(
            f"| {transitions} | {1e3 * median:.0f} | {1e3 * worst:.0f} | {median / interval:.3%} "
            f"| {worst / interval:.3%} | {cost.resume:.1f} | {cost.checkpoint_bytes / _MIB:.1f} "
            f"| {cost.journal_bytes / _MIB:.0f} |"
        )


if __name__ == "__main__":
    main()
