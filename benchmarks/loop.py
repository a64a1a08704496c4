"""Where a step's time goes: each stage alone, then all of them in the running loop.

    python -m benchmarks.loop

Alone: one request under way in the whole system, and one gradient update at a time. In the loop: a real training by
`orchestrator train`, where the stages of several flights overlap and share the cores. Prints a Markdown table.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

import msgspec
import numpy as np
from msgspec.structs import replace
from rich.console import Console

from agent.learner import Transition, make_learner
from agent.spaces import ACTION_SIZE, OBSERVATION_SIZE
from agent.stages import times_of
from benchmarks.machine import machine_kind
from benchmarks.viewpoints import front_views, observe_requests
from orchestrator.live_display import open_display
from orchestrator.report import TrainingReport
from orchestrator.stop_request import stop_on_signals
from orchestrator.worker_pair import WorkerPair, worker_pair
from protocol.config import LearnerConfig, RunConfig, load_config
from protocol.records import Stage

STAGES: tuple[Stage, ...] = get_args(Stage)


def stages_alone(config: RunConfig, requests: int, console: Console) -> dict[Stage, float]:
    """Median seconds of each stage with nothing else under way."""
    with (
        stop_on_signals() as stop,
        open_display(console) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        seconds = _seconds_by_stage(pair, config, requests)
    seconds["learn"] = _updates_alone(config)
    return {stage: statistics.median(values) for stage, values in seconds.items()}


def _seconds_by_stage(pair: WorkerPair, config: RunConfig, requests: int) -> dict[Stage, list[float]]:
    seconds: dict[Stage, list[float]] = {}
    # Each scene twice: the first picture of a body also uploads it, which an episode does once in a hundred steps.
    for request in observe_requests(pair, front_views(seed=0), requests, config.environment, split="train"):
        pair.perceiver.call(request)
        pending = pair.perceiver.submit(request)
        pending.result()
        for stage, value in times_of(pending).items():
            seconds.setdefault(stage, []).append(value)
    return seconds


def _updates_alone(config: RunConfig, updates: int = 60) -> list[float]:
    """Seconds of single gradient updates of SAC on a memory of random transitions."""
    envs = config.environment.num_envs
    sac = replace(config.learner.sac, updates_per_step=1 / envs)
    learner = make_learner(LearnerConfig(algorithm="sac", sac=sac), config.environment, seed=0)
    rng = np.random.default_rng(0)
    for _ in range(sac.batch // envs):
        learner.observe(_random_transition(rng, envs))
    seconds: list[float] = []
    while len(seconds) < updates:
        learner.observe(_random_transition(rng, envs))
        before, begun = learner.updates, time.perf_counter()
        learner.learn()
        if learner.updates == before + 1:
            seconds.append(time.perf_counter() - begun)
    return seconds


def _random_transition(rng: np.random.Generator, envs: int) -> Transition:
    observations = rng.normal(size=(2, envs, OBSERVATION_SIZE)).astype(np.float32)
    return Transition(
        observations=observations[0],
        actions=rng.uniform(-1, 1, (envs, ACTION_SIZE)).astype(np.float32),
        rewards=rng.normal(size=envs),
        next_observations=observations[1],
        terminated=np.zeros(envs, dtype=bool),
        truncated=np.zeros(envs, dtype=bool),
    )


def loop_report(config: Path) -> TrainingReport:
    """What a training says of itself at its end."""
    with tempfile.TemporaryDirectory() as directory:
        command = (sys.executable, "-m", "orchestrator", "train", str(config), "--json", "--no-evaluate")
        done = subprocess.run((*command, "--run", f"{directory}/run"), stdout=subprocess.PIPE, check=True)
    return msgspec.json.decode(done.stdout, type=TrainingReport)


def table(alone: Mapping[Stage, float], loop: Mapping[Stage, Any]) -> str:
    """Milliseconds of each stage, and its share of the sum of all stages alone."""
    total = sum(alone.values())
    rows = [
        f"| {stage} | {1e3 * alone[stage]:.2f} | {alone[stage] / total:.1%} | {1e3 * (loop[stage] or 0.0):.2f} |"
        for stage in STAGES
    ]
    head = ["| stage | alone, ms | share | in the loop, ms |", "|---|---:|---:|---:|"]
    return "\n".join([*head, *rows, f"| sum | {1e3 * total:.1f} | 100% | |"])


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.loop", description=__doc__)
    parser.add_argument("--config", type=Path, default=Path("configs/benchmark.toml"))
    parser.add_argument("--requests", type=int, default=100, help="pictures for the stages alone")
    options = parser.parse_args(arguments)
    errors, console = Console(stderr=True), Console(soft_wrap=True)
    config = load_config(options.config)
    alone = stages_alone(config, options.requests, errors)
    report = loop_report(options.config)
    console.print(f"machine: {machine_kind()}")
    console.print(table(alone, report.stages), markup=False)
    console.print(
        f"\nthe loop: {report.steps} steps at {report.steps_per_second:.2f} steps/s, "
        f"{report.updates / max(report.steps, 1):.2f} updates a step, "
        f"{report.retries} retries, {report.late_replies} late replies"
    )


if __name__ == "__main__":
    main()
