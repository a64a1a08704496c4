"""Proximal policy optimisation on skrl's agent, with truncation handled correctly.

A truncated flight is bootstrapped with the value of its own last observation, and the advantage of the next flight
does not leak into it: skrl does both when it gets the final observation, not the next flight's first.
"""

from collections.abc import Iterable
from typing import Any

import torch
from numpy.typing import NDArray
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.memories.torch import RandomMemory
from skrl.models.torch import Model

from agent.environment.spaces import action_space
from agent.environment.versions import hover_task
from agent.learning.features_v1 import make_features
from agent.learning.learner import Statistics, Transition, learned_rewards
from agent.learning.networks import GaussianPolicy, Value
from agent.learning.randomness import random_state, restore_random_state, seed_all
from agent.learning.skrl_state import (
    load_network_weights,
    memory_tensors,
    network_weights,
    optimizers_state,
    restore_memory_tensors,
    restore_optimizers,
    tracked,
)
from protocol.arrays import Float32Array
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import PpoConfig

_UNDER_WAY = ("_current_log_prob", "_current_values", "_current_next_observations")
"""The attributes in which skrl keeps state between acting, observing and learning."""


class PpoLearner:
    """Learns from the steps of its own last rollout, each `n_steps` steps of every drone.

    The action that is under way while it learns was drawn from the policy before. It goes into the next rollout with
    the log-probability it was drawn with, so the ratio that is clipped stays right.
    """

    off_policy = False
    memory_steps = 0

    def __init__(self, config: PpoConfig, environment: EnvironmentConfig, *, seed: int) -> None:
        num_envs = environment.num_envs
        config.require_minibatches(num_envs)
        torch.set_num_threads(1)
        seed_all(seed)
        self.updates = 0
        self._config = config
        self._observed = 0
        self._learned = 0
        self._memory = RandomMemory(memory_size=config.n_steps, num_envs=num_envs, device="cpu")
        self._features = make_features(environment)
        self._policy = GaussianPolicy(self._features.space(), action_space(), config.hidden_sizes)
        self._agent = _ppo_agent(config, environment, self._policy, self._memory)

    def act(self, observations: Float32Array, *, explore: bool) -> Float32Array:
        """Velocities (n, 3), drawn from the policy (the drone cuts them at its limits) or its best."""
        batch = torch.from_numpy(observations)
        with torch.no_grad():
            if not explore:
                return self._policy.compute({"observations": self._features(batch)})[0].numpy()
            return self._agent.act(batch, None, timestep=0, timesteps=0)[0].numpy()

    def observe(self, transition: Transition) -> None:
        """Keep the step that followed the last `act`."""
        config = self._config
        rewards = learned_rewards(transition.rewards, config.reward_floor, config.reward_scale)
        unused: dict[str, Any] = {"states": None, "next_states": None, "infos": None, "timestep": 0, "timesteps": 0}
        self._agent.record_transition(
            observations=torch.from_numpy(transition.observations),
            actions=torch.from_numpy(transition.actions),
            rewards=torch.from_numpy(rewards)[:, None],
            next_observations=torch.from_numpy(transition.next_observations),
            terminated=torch.from_numpy(transition.terminated)[:, None],
            truncated=torch.from_numpy(transition.truncated)[:, None],
            **unused,
        )
        self._observed += 1

    def learn(self) -> Statistics:
        """Make the updates of a rollout once it is whole."""
        if self._observed < self._learned + self._config.n_steps:
            return {}
        self._learned = self._observed
        self._agent.update(timestep=0, timesteps=0)
        self.updates += self._config.n_epochs * self._config.minibatches
        return tracked(self._agent)

    def state(self) -> dict[str, Any]:
        """The state beside the weights, a rollout under way included; see `Learner.state`."""
        under_way = {name: getattr(self._agent, name) for name in _UNDER_WAY}
        return {
            "optimizers": optimizers_state(self._agent),
            "rollout": memory_tensors(self._memory),
            "memory_index": self._memory.memory_index,
            "memory_filled": self._memory.filled,
            "under_way": {name: None if value is None else value.clone() for name, value in under_way.items()},
            "observed": self._observed,
            "learned": self._learned,
            "updates": self.updates,
            "random": random_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        restore_optimizers(self._agent, state["optimizers"])
        restore_memory_tensors(self._memory, state["rollout"])
        self._memory.memory_index, self._memory.filled = state["memory_index"], state["memory_filled"]
        for name, value in state["under_way"].items():
            setattr(self._agent, name, None if value is None else value.clone())
        self._observed, self._learned, self.updates = state["observed"], state["learned"], state["updates"]
        restore_random_state(state["random"])

    def recall(self, steps: Iterable[Transition]) -> None:
        """Nothing: what it learns from is in its own state."""

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of the policy and the value network."""
        return network_weights(self._agent)

    def load_weights(self, weights: dict[str, NDArray[Any]]) -> None:
        """Take another learner's parameters."""
        load_network_weights(self._agent, weights)


def _ppo_agent(config: PpoConfig, environment: EnvironmentConfig, policy: GaussianPolicy, memory: RandomMemory) -> PPO:
    value = Value(make_features(environment).space(), action_space(), config.hidden_sizes)
    models: dict[str, Model] = {"policy": policy, "value": value}
    agent = PPO(
        models=models,
        memory=memory,
        cfg=_settings(config, environment),
        device="cpu",
        observation_space=hover_task(environment).observation_space(),
        action_space=action_space(),
    )
    agent.init()
    agent.enable_training_mode(True)
    return agent


def _settings(config: PpoConfig, environment: EnvironmentConfig) -> PPO_CFG:
    settings = PPO_CFG(
        rollouts=config.n_steps,
        learning_epochs=config.n_epochs,
        mini_batches=config.minibatches,
        discount_factor=config.gamma,
        gae_lambda=config.gae_lambda,
        learning_rate=config.learning_rate,
        ratio_clip=config.clip_range,
        # It is in the units of the return, so it would hold the value back instead of stabilising it.
        value_clip=0.0,
        value_loss_scale=1.0,
        entropy_loss_scale=config.ent_coef,
        time_limit_bootstrap=True,
        observation_preprocessor=type(make_features(environment)),
        observation_preprocessor_kwargs={"workspace": environment},
    )
    settings.experiment.write_interval = settings.experiment.checkpoint_interval = 0
    return settings
