"""The speed of our recurrent PPO, and of sb3-contrib's on the same task with the same networks and settings.

    python -m benchmarks.recurrent_ppo --table thesis

Both train on `vantage/Grid-v0`, on one thread. They take turns of a rollout and its updates, so that other work on the
machine affects both alike. Prints a Markdown table; speeds are of the process's own time, and of the clock.

sb3-contrib's depends on the lengths of episodes, since it fills them all up to the longest. At the beginning of a
training most are cut off by the rollout; `--warm-up` lets both learn for a while before the turns that count.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from agent.environment.grid.grid import Grid
from agent.environment.grid.vector_grid import VectorGrid
from agent.learning.recurrent.recurrent_ppo import RecurrentPpoLearner
from agent.training import transition_of
from benchmarks.machine import machine_kind
from protocol.grid.named_tables import open_table
from protocol.grid.table import GridTable
from protocol.grid_config import GridConfig
from protocol.learner_config import RecurrentPpoConfig

OURS, THEIRS = "Vantage", "sb3-contrib"
THESIS_STEPS = 1_500_000
"""Environment steps of a training. Source: thesis, section 4.4."""


class Turn(Struct, frozen=True):
    """Seconds that a rollout and its updates took: of the process's own time, and by the clock."""

    own: float
    clock: float


class Speed(Struct, frozen=True):
    """Environment steps a second, in the process's own time and by the clock."""

    own: float
    clock: float

    @classmethod
    def median(cls, turns: Sequence[Turn], steps: int) -> "Speed":
        """Of turns of so many steps each."""
        own, clock = (float(np.median([getattr(turn, name) for turn in turns])) for name in ("own", "clock"))
        return cls(steps / own, steps / clock)


class Ours:
    """Our learner on the grid, step by step as a training does it."""

    def __init__(self, config: RecurrentPpoConfig, grid: GridConfig, table: GridTable) -> None:
        self._n_steps = config.n_steps
        self._env = VectorGrid(table, config=grid)
        self._env.reset(seed=0)
        self._learner = RecurrentPpoLearner(config, self._env.num_envs, seed=0)

    def take_turn(self) -> None:
        """A rollout and its updates."""
        for _ in range(self._n_steps):
            observations = self._env.observations
            actions = self._learner.act(observations, explore=True)
            self._learner.observe(transition_of(observations, actions, self._env.step(actions)))
        self._learner.learn()


class Theirs:
    """sb3-contrib's learner, unchanged, on as many environments of Gymnasium's."""

    def __init__(self, config: RecurrentPpoConfig, grid: GridConfig, table: GridTable) -> None:
        # Imported here: they load slowly, and a test of this module needs neither.
        from sb3_contrib import RecurrentPPO
        from stable_baselines3.common.env_util import make_vec_env

        def make() -> gymnasium.Env[Any, Any]:
            return Grid(table, config=grid)

        self._steps = config.n_steps * grid.num_envs
        self._model = RecurrentPPO(
            "MlpLstmPolicy",
            make_vec_env(make, n_envs=grid.num_envs, seed=0),
            learning_rate=config.learning_rate,
            n_steps=config.n_steps,
            batch_size=self._steps // config.minibatches,
            n_epochs=config.n_epochs,
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
            clip_range=config.clip_range,
            ent_coef=config.ent_coef,
            vf_coef=config.vf_coef,
            max_grad_norm=config.max_grad_norm,
            policy_kwargs={
                "n_lstm_layers": config.n_lstm_layers,
                "lstm_hidden_size": config.lstm_hidden_size,
                "shared_lstm": False,
                "enable_critic_lstm": True,
                "net_arch": {"pi": [config.hidden_size], "vf": [config.hidden_size]},
            },
            seed=0,
            device="cpu",
        )

    def take_turn(self) -> None:
        """A rollout and its updates."""
        self._model.learn(self._steps, reset_num_timesteps=False)


def timed(take_turn: Callable[[], None]) -> Turn:
    """Take a turn."""
    own, clock = time.process_time(), time.perf_counter()
    take_turn()
    return Turn(time.process_time() - own, time.perf_counter() - clock)


def markdown(speeds: dict[str, Speed]) -> str:
    """The speeds by learner, the minutes of a training, and how many times as fast the first is as each."""
    first = next(iter(speeds.values()))
    head = [
        f"| learner | steps/s of its own time | steps/s by the clock | {THESIS_STEPS:,} steps, own minutes | ratio |",
        "|---|---:|---:|---:|---:|",
    ]
    rows = [
        f"| {name} | {speed.own:.0f} | {speed.clock:.0f} | {THESIS_STEPS / speed.own / 60:.1f} "
        f"| {first.own / speed.own:.1f} |"
        for name, speed in speeds.items()
    ]
    return "\n".join([*head, *rows])


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recurrent_ppo", description=__doc__)
    parser.add_argument("--table", default="thesis", help="a grid table that ships, or the path of one")
    parser.add_argument("--turns", type=int, default=5, help="of each learner, that count")
    parser.add_argument("--warm-up", type=int, default=1, help="turns of each learner before those that count")
    parser.add_argument("--num-envs", type=int, default=GridConfig().num_envs)
    parser.add_argument("--minibatches", type=int, default=RecurrentPpoConfig().minibatches)
    parser.add_argument("--alone", action="store_true", help="our learner alone")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    config = replace(RecurrentPpoConfig(), minibatches=options.minibatches)
    grid, table = GridConfig(table=options.table, num_envs=options.num_envs), open_table(options.table)
    learners: dict[str, Ours | Theirs] = {OURS: Ours(config, grid, table)}
    if not options.alone:
        learners[THEIRS] = Theirs(config, grid, table)
    turns: dict[str, list[Turn]] = {name: [] for name in learners}
    for _ in range(options.warm_up + options.turns):
        for name, learner in learners.items():
            turns[name].append(timed(learner.take_turn))
    steps = config.n_steps * grid.num_envs
    console = Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}; {grid.num_envs} drones, rollouts of {config.n_steps} steps each")
    console.print(
        markdown({name: Speed.median(taken[options.warm_up :], steps) for name, taken in turns.items()}), markup=False
    )


if __name__ == "__main__":
    main()
