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
from protocol.config import LearnerConfig, RunConfig, SacConfig

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
    drones, every = config.environment.num_envs, config.training.checkpoint_every
    learner = make_learner(config.learner, config.environment, seed=0)
    store, rng = Checkpoints(directory / "checkpoints", config), np.random.default_rng(0)
    with ReplayJournal(directory / REPLAY, drones) as journal:
        episodes = AppendOnlyFile(directory / "episodes.jsonl")

        def fly(steps: int) -> None:
            for _ in range(steps):
                transition = _made_up(rng, drones)
                learner.observe(transition)
                journal.append(transition)

        def sync() -> Grown:
            episodes.sync()
            return Grown(episodes=episodes.mark, replay=journal.sync())

        fly(transitions // drones)
        journal.sync()
        # Some updates, so that the optimisers have something to keep.
        learner.updates = transitions - config.learner.sac.batch_size - 8
        learner.learn()
        seconds: list[float] = []
        for number in range(checkpoints):
            fly(every // drones)
            step = transitions + (number + 1) * every

            def keep(step: int = step) -> None:
                store.write(_content(learner, step), sync)
                save_weights(directory / FILE_NAME, learner.weights(), {})

            seconds.append(_seconds_of(keep))
    return Cost(
        transitions=transitions,
        checkpoints=seconds,
        resume=_seconds_of(lambda: resume(directory, config)),
        checkpoint_bytes=_size(max((directory / "checkpoints").iterdir())),
        journal_bytes=_size(directory / REPLAY),
    )


def resume(directory: Path, config: RunConfig) -> None:
    """Verify the files of the newest checkpoint, and fill a learner from it."""
    newest = Checkpoints(directory / "checkpoints", config).newest()
    if newest is None:
        return
    newest.require_grown(directory)
    learner = make_learner(config.learner, config.environment, seed=0)
    learner.load_weights(newest.weights())
    learner.restore(newest.state()["learner"])
    with ReplayJournal(directory / REPLAY, config.environment.num_envs, newest.manifest.grown.replay) as journal:
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
