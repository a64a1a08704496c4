"""What the tests of both learners need: small learners, steps to learn from, and a digest of all that was learned."""

import copy
import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from agent.environment.vector_hover import VectorHover
from agent.learning.learner import Learner, Transition
from agent.training import transition_of
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import PpoConfig, SacConfig
from tests.agent.analytic_sensor import AnalyticSensor

DRONES = 2
FLIGHTS = EnvironmentConfig(num_envs=DRONES, episode_steps=7)
SAC = SacConfig(reward_scale=1.0, hidden_sizes=(16, 16), buffer_size=32, batch_size=8, updates_per_step=0.5)
PPO = PpoConfig(hidden_sizes=(16, 16), n_steps=6, n_epochs=2, minibatches=2)


class Flock:
    """Two drones that a learner flies, step by step as a training does."""

    def __init__(self, config: EnvironmentConfig = FLIGHTS) -> None:
        self._env = VectorHover(AnalyticSensor(), config=config)
        self._observations, _ = self._env.reset(seed=1)
        self.flown: list[Transition] = []

    def fly(self, learner: Learner, steps: int) -> None:
        for _ in range(steps):
            actions = learner.act(self._observations, explore=True)
            self._env.send(actions)
            learner.learn()
            result = self._env.receive()
            self.flown.append(transition_of(self._observations, actions, result))
            learner.observe(self.flown[-1])
            self._observations = result[0]

    def snapshot(self) -> "Flock":
        """The same flights once more, to go on from here twice."""
        return copy.deepcopy(self)


class Kept:
    """A learner as it is now, in the parts that a checkpoint has."""

    def __init__(self, learner: Learner, flown: Sequence[Transition]) -> None:
        self._weights, self._state = learner.weights(), learner.state()
        self._steps = flown[len(flown) - learner.memory_steps :]

    def put_into(self, learner: Learner, at_once: int = 1000) -> None:
        """Have another go on from there; `at_once` is how many steps it gets back at a time."""
        learner.load_weights(self._weights)
        learner.restore(self._state)
        pieces = range(0, len(self._steps), at_once)
        learner.recall(stacked(self._steps[first : first + at_once]) for first in pieces)


def stacked(steps: Sequence[Transition]) -> Transition:
    """Several steps with an axis for them."""
    names = Transition.__struct_fields__
    return Transition(**{name: np.stack([getattr(step, name) for step in steps]) for name in names})


def digest(learner: Learner) -> str:
    """Of everything that lasts in a learner but the steps in replay memory."""
    sums = hashlib.sha256()
    _feed(sums, learner.weights())
    _feed(sums, learner.state())
    return sums.hexdigest()


def parameters(learner: Learner, network: str) -> dict[str, torch.Tensor]:
    """Of one of a learner's networks."""
    own = {name.partition("."): array for name, array in learner.weights().items()}
    return {name: torch.from_numpy(array) for (first, _, name), array in own.items() if first == network}


def _feed(sums: Any, value: Any) -> None:
    if isinstance(value, dict):
        for key in sorted(value, key=str):
            sums.update(str(key).encode())
            _feed(sums, value[key])
    elif isinstance(value, list | tuple):
        for item in value:
            _feed(sums, item)
    elif hasattr(value, "numpy") or isinstance(value, np.ndarray):
        sums.update(np.asarray(value).tobytes())
    else:
        sums.update(repr(value).encode())


def same_again(rewards: list[float], *, terminated: bool = False, truncated: bool = False) -> Transition:
    """A step of drones that stay where they are and see the same again."""
    count = len(rewards)
    observations = np.tile(np.linspace(0.1, 1.0, 111, dtype=np.float32), (count, 1))
    return Transition(
        observations=observations,
        actions=np.zeros((count, 3), np.float32),
        rewards=np.array(rewards),
        next_observations=observations,
        terminated=np.full(count, terminated),
        truncated=np.full(count, truncated),
    )
