"""How many environment steps a second the vectorised grid takes, with random actions and nothing learned.

python -m benchmarks.grid_steps --num-envs 128 1024 4096
"""

import argparse
import sys
import time
from collections.abc import Sequence

import numpy as np

from agent.environment.grid.vector_grid import VectorGrid
from benchmarks.machine import machine_kind

STEPS = 200
"""Of every drone in a repetition."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a Markdown table."""
    options = _parser().parse_args(arguments)
    rows = [f"| {count} | {steps_per_second(count, options.repetitions) / 1e6:.2f} |" for count in options.num_envs]
    head = ["| drones | million steps/s, one core |", "|---:|---:|"]
    sys.stdout.write(
        "\n".join([*head, *rows, "", f"{machine_kind()}; processor time, best of {options.repetitions}", ""])
    )
    return 0


def steps_per_second(num_envs: int, repetitions: int) -> float:
    """Environment steps in a second of processor time, in the best repetition."""
    env = VectorGrid(num_envs=num_envs)
    env.reset(seed=0)
    actions = np.random.default_rng(0).integers(8, size=(STEPS, num_envs))
    return STEPS * num_envs / min(_seconds(env, actions) for _ in range(repetitions))


def _seconds(env: VectorGrid, actions: np.ndarray) -> float:
    begun = time.process_time()
    for each in actions:
        env.step(each)
    return time.process_time() - begun


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--num-envs", type=int, nargs="+", default=[128, 1024, 4096], help="drones (128 1024 4096)")
    parser.add_argument("--repetitions", type=int, default=10, help="of which the best counts (10)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
