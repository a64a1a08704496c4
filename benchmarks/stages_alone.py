"""Each stage of a step with nothing else under way: one request in the whole system, one gradient update at a time.

    python -m benchmarks.stages_alone

Prints a line of JSON, for `benchmarks.loop`. Run as a file (`python -P benchmarks/stages_alone.py`) it measures the
rooms of the checkout that `PYTHONPATH` names, so that two are measured by the same code.
"""

import argparse
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from agent.environment.spaces import ACTION_SIZE, OBSERVATION_SIZE
from agent.environment.stages import times_of
from agent.learning.algorithms import make_learner
from agent.learning.learner import Transition
from benchmarks.estimation.viewpoints import front_views, observe_requests
from orchestrator.monitoring.live_display import Display, FrameCount, Snapshot, open_display
from orchestrator.pictures.worker_pair import WorkerPair, worker_pair
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.learner_config import LearnerConfig
from protocol.records import Stage
from protocol.system.stop_request import stop_on_signals


class StagesAlone(Struct, frozen=True):
    """The cost of one picture and of one update.

    Attributes:
        seconds: median of each stage; of `learn`, that of one gradient update.
        updates_per_step: that the configuration asks for, once the memory holds a batch.
    """

    seconds: dict[Stage, float]
    updates_per_step: float


def stages_alone(config: RunConfig, requests: int, console: Console) -> StagesAlone:
    """Measure every stage; how far that is shows on the console."""
    with stop_on_signals() as stop, open_display(console) as display:
        with worker_pair(config, display=display, stop=stop) as pair:
            seconds = _seconds_by_stage(pair, config, requests, display)
        display.show(Snapshot(activity="measuring gradient updates alone", elapsed=0.0))
        seconds["learn"] = _updates_alone(config)
    medians: dict[Stage, float] = {stage: statistics.median(values) for stage, values in seconds.items()}
    return StagesAlone(medians, config.learner.sac.updates_per_step)


def _seconds_by_stage(pair: WorkerPair, config: RunConfig, requests: int, display: Display) -> dict[Stage, list[float]]:
    seconds: dict[Stage, list[float]] = {}
    begun = time.monotonic()
    views = observe_requests(pair, front_views(seed=0), requests, config.environment, split="train")
    for done, request in enumerate(views):
        # Each scene twice: the first picture of a body also uploads it, which an episode does once in a hundred steps.
        # A step sends a filter that has seen the person; one that knows no person may be detected otherwise.
        known = pair.perceiver.call(request).filter
        pending = pair.perceiver.submit(replace(request, filter=known))
        pending.result()
        for stage, value in times_of(pending).items():
            seconds.setdefault(stage, []).append(value)
        display.show(_progress(done + 1, requests, time.monotonic() - begun))
    return seconds


def _progress(done: int, requests: int, elapsed: float) -> Snapshot:
    count = FrameCount(step=done, steps=requests, steps_per_second=done / elapsed)
    return Snapshot(activity="measuring the stages alone", elapsed=elapsed, progress=count)


def _updates_alone(config: RunConfig, updates: int = 60) -> list[float]:
    """Seconds of single gradient updates of SAC on a memory of random transitions."""
    envs = config.environment.num_envs
    sac = replace(config.learner.sac, updates_per_step=1 / envs)
    learner = make_learner(LearnerConfig(algorithm="sac", sac=sac), config.environment, seed=0)
    return measured_updates(learner, sac.batch_size, envs, updates)


class Updating(Protocol):
    """The timed parts of a learner."""

    updates: int

    def observe(self, transition: Transition) -> None:
        """Take in a step."""
        ...

    def learn(self) -> Any:
        """Make the updates that are due."""
        ...


def measured_updates(learner: Updating, batch: int, envs: int, updates: int) -> list[float]:
    """Seconds of single updates, on a memory of random transitions."""
    rng = np.random.default_rng(0)
    for _ in range(batch // envs):
        learner.observe(random_transition(rng, envs))
    seconds: list[float] = []
    while len(seconds) < updates:
        learner.observe(random_transition(rng, envs))
        before, begun = learner.updates, time.perf_counter()
        learner.learn()
        if learner.updates == before + 1:
            seconds.append(time.perf_counter() - begun)
    return seconds


def random_transition(rng: np.random.Generator, envs: int) -> Transition:
    """A step of all drones that means nothing."""
    observations = rng.normal(size=(2, envs, OBSERVATION_SIZE)).astype(np.float32)
    return Transition(
        observations=observations[0],
        actions=rng.uniform(-1, 1, (envs, ACTION_SIZE)).astype(np.float32),
        rewards=rng.normal(size=envs),
        next_observations=observations[1],
        terminated=np.zeros(envs, dtype=bool),
        truncated=np.zeros(envs, dtype=bool),
    )


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the measurement."""
    parser.add_argument(
        "--config", type=Path, default=Path("configs/benchmark.toml"), help="relative to the checkout that runs it"
    )
    parser.add_argument("--requests", type=int, default=100, help="pictures for the stages alone")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stages_alone",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_options(parser)
    options = parser.parse_args(arguments)
    found = stages_alone(load_config(options.config), options.requests, Console(stderr=True))
    print(msgspec.json.encode(found).decode())  # noqa: T201 (a program reads it)


if __name__ == "__main__":
    main()
