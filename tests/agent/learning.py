"""What the tests of both learners need: small learners, steps to learn from, and a digest of all that was learned."""

import copy
import hashlib
from typing import Any

import numpy as np

from agent.learner import Learner, Transition
from agent.training import transition_of
from agent.vector_hover import VectorHover
from protocol.config import EnvironmentConfig, PpoConfig, SacConfig
from tests.agent.analytic_eyes import AnalyticEyes

DRONES = 2
FLIGHTS = EnvironmentConfig(num_envs=DRONES, episode_steps=7)
SAC = SacConfig(reward_scale=1.0, hidden=(16, 16), memory=32, batch=8, updates_per_step=0.5)
PPO = PpoConfig(hidden=(16, 16), rollout=6, epochs=2, minibatches=2)


class Flock:
    """Two drones that a learner flies, step by step as a training does."""

    def __init__(self, config: EnvironmentConfig = FLIGHTS) -> None:
        self._env = VectorHover(AnalyticEyes(), config=config)
        self._observations, _ = self._env.reset(seed=1)

    def fly(self, learner: Learner, steps: int) -> None:
        for _ in range(steps):
            actions = learner.act(self._observations, explore=True)
            self._env.send(actions)
            learner.learn()
            result = self._env.receive()
            learner.observe(transition_of(self._observations, actions, result))
            self._observations = result[0]

    def snapshot(self) -> "Flock":
        """The same flights once more, to go on from here twice."""
        return copy.deepcopy(self)


def digest(learner: Learner) -> str:
    """Of everything that lasts in a learner."""
    sums = hashlib.sha256()
    _feed(sums, learner.state())
    return sums.hexdigest()


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
