"""A learner that draws from every random generator there is, so that each of them matters to what it flies."""

import random
from typing import Any

import numpy as np

from agent.environment.vector_hover import VectorHover
from agent.learning.algorithms import make_learner
from agent.learning.learner import Learner
from protocol.arrays import Float32Array
from protocol.config import RunConfig


class Restless:
    """Another learner with a little of everything added to its velocities."""

    def __init__(self, learner: Learner, env: VectorHover) -> None:
        self._learner = learner
        self._env = env

    def act(self, observations: Float32Array, *, explore: bool) -> Float32Array:
        env = self._env
        drawn = random.random() + np.random.random() + env.np_random.random()  # noqa: NPY002
        drawn += env.action_space.sample()[: len(observations)] + env.single_action_space.sample()
        return self._learner.act(observations, explore=explore) + (0.01 * drawn).astype(np.float32)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._learner, name)


def restless(config: RunConfig, env: VectorHover) -> Learner:
    """The configured learner, made restless."""
    return Restless(make_learner(config.learner, config.environment, seed=config.seed), env)  # pyright: ignore[reportReturnType]
