"""The time of learning, by the code of this checkout and by that of another.

    python -m benchmarks.updates --against ../before

Each learns in a process of its own, from the default configuration and a replay memory of random transitions. They take
turns, so that other work on the machine affects both alike, and the times are of their threads, not of the clock.
Prints a Markdown table.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from agent.environment.spaces import ACTION_SIZE, OBSERVATION_SIZE
from agent.learning.algorithms import make_learner
from agent.learning.learner import Learner, Transition
from benchmarks.machine import machine_kind
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.learner_config import LearnerConfig

PARTS = {"update": "a gradient update", "observe": "a step of all drones, put in memory", "act": "velocities, chosen"}
_HERE = Path(__file__).parent.parent
_WARM_UP = 50
"""Steps before the first that count."""


def learner_with_memory(transitions: int, environment: EnvironmentConfig) -> Learner:
    """A learner of the default configuration with so many random transitions in memory, and no update due."""
    learner = make_learner(LearnerConfig(algorithm="sac"), environment, seed=0)
    steps = transitions // environment.num_envs
    learner.restore({**learner.state(), "memory_index": steps, "observed": LearnerConfig().sac.batch_size})
    learner.recall([random_transition(np.random.default_rng(0), steps, environment.num_envs)])
    return learner


def random_transition(rng: np.random.Generator, *shape: int) -> Transition:
    """Steps whose observations are of the right size and of no meaning; variances are positive."""
    observations = rng.normal(size=(2, *shape, OBSERVATION_SIZE)).astype(np.float32)
    return Transition(
        observations=abs(observations[0]),
        actions=rng.uniform(-1, 1, (*shape, ACTION_SIZE)).astype(np.float32),
        rewards=rng.normal(size=shape),
        next_observations=abs(observations[1]),
        terminated=rng.random(shape) < 0.01,
        truncated=np.zeros(shape, dtype=bool),
    )


def answer_turns(transitions: int) -> None:
    """Learn from as many steps as a line of the input says, and print the milliseconds of each; until there is none."""
    environment = EnvironmentConfig()
    learner, rng = learner_with_memory(transitions, environment), np.random.default_rng(1)
    for line in sys.stdin:
        taken: defaultdict[str, list[float]] = defaultdict(list)
        for _ in range(int(line)):
            transition, before = random_transition(rng, environment.num_envs), learner.updates
            taken["act"].append(_milliseconds(lambda seen=transition.observations: learner.act(seen, explore=True)))
            taken["observe"].append(_milliseconds(lambda step=transition: learner.observe(step)))
            learning = _milliseconds(learner.learn)
            taken["update"].append(learning / (learner.updates - before))
        sys.stdout.write(json.dumps(taken) + "\n")
        sys.stdout.flush()


def _milliseconds(do: Callable[[], Any]) -> float:
    begun = time.thread_time()
    do()
    return 1e3 * (time.thread_time() - begun)


class Learning:
    """A process that learns by the code of a checkout, when it is its turn."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self.taken: defaultdict[str, list[float]] = defaultdict(list)
        self._turn(_WARM_UP)

    def take_turn(self, steps: int) -> None:
        """Learn from so many steps."""
        for part, milliseconds in self._turn(steps).items():
            self.taken[part] += milliseconds

    def medians(self) -> dict[str, float]:
        """Milliseconds by part."""
        return {part: statistics.median(milliseconds) for part, milliseconds in self.taken.items()}

    def _turn(self, steps: int) -> dict[str, list[float]]:
        requests, answers = self._process.stdin, self._process.stdout
        if requests is None or answers is None:
            raise InvalidInput("the process that learns was started without pipes")
        requests.write(f"{steps}\n")
        requests.flush()
        return json.loads(answers.readline())


@contextmanager
def learning_by(checkout: Path, transitions: int) -> Generator[Learning]:
    """A process of the code of a checkout, with this file to run it."""
    environment = {**os.environ, "PYTHONPATH": str(checkout.resolve()), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-P", __file__, "--answer", "--transitions", str(transitions)]
    with subprocess.Popen(
        command, env=environment, cwd=checkout, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield Learning(process)
        # The end of its input is the end of its turns.


def table(ours: Mapping[str, float], theirs: Mapping[str, float] | None) -> str:
    """Milliseconds by part, and those of the other checkout against them."""
    head = ["| part | ms |", "|---|---:|"]
    if theirs is not None:
        head = ["| part | here, ms | there, ms | there / here |", "|---|---:|---:|---:|"]
    rows = [
        f"| {name} | {ours[part]:.2f} |"
        + (f" {theirs[part]:.2f} | {theirs[part] / ours[part]:.2f} |" if theirs is not None else "")
        for part, name in PARTS.items()
    ]
    return "\n".join([*head, *rows])


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.updates", description=__doc__)
    parser.add_argument("--against", type=Path, help="a checkout of other code, to take turns with")
    parser.add_argument("--transitions", type=int, default=50_000, help="in memory")
    parser.add_argument("--turns", type=int, default=20)
    parser.add_argument("--steps", type=int, default=15, help="of all drones, a turn")
    parser.add_argument("--answer", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.answer:
        answer_turns(options.transitions)
        return
    with ExitStack() as opened:
        checkouts = [_HERE] if options.against is None else [_HERE, options.against]
        learning = [opened.enter_context(learning_by(checkout, options.transitions)) for checkout in checkouts]
        for _ in range(options.turns):
            for one in learning:
                one.take_turn(options.steps)
        medians = [one.medians() for one in learning]
    console = Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}")
    console.print(table(medians[0], medians[1] if len(medians) > 1 else None), markup=False)


if __name__ == "__main__":
    main()
