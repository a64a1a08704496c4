"""Soft actor-critic (thesis, section 4.3.2) on skrl's agent, with a loop, a policy and a checkpoint of our own.

skrl's trainers always begin at step 0 and its checkpoints leave out the entropy coefficient, the replay memory and the
random generators; here `state` has all of them but the transitions, which `recall` puts back.

In memory are features, not observations: a transition is drawn hundreds of times and its features stay the same. They
do not depend on which other transitions they are computed with, so those that `recall` derives are the same to the bit.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from numpy.typing import NDArray
from skrl.agents.torch.sac import SAC, SAC_CFG
from skrl.memories.torch import Memory, RandomMemory
from skrl.models.torch import Model
from torch import Tensor

from agent.environment.spaces import action_space
from agent.learning.features import RecentFeatures
from agent.learning.features_v1 import make_features
from agent.learning.learner import Statistics, Transition, learned_rewards
from agent.learning.networks import Critic, SquashedPolicy
from agent.learning.randomness import random_state, restore_random_state, seed_all
from agent.learning.sac_update import STATISTICS, SacNetworks, SacUpdate
from agent.learning.skrl_state import (
    load_network_weights,
    network_weights,
    optimizers_state,
    restore_optimizers,
)
from protocol.arrays import Float32Array
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import SacConfig

_FEATURES_AT_ONCE = 4096
"""Rows; what is computed on the way to them would else take several times the memory of a journal's segment."""


class SacLearner:
    """Learns from all transitions in its memory, its own or others'; `updates_per_step` for each one observed."""

    off_policy = True

    def __init__(self, config: SacConfig, environment: EnvironmentConfig, *, seed: int) -> None:
        num_envs = environment.num_envs
        config.require_batch(num_envs)
        torch.set_num_threads(1)
        seed_all(seed)
        self.updates = 0
        self._observed = 0
        self._config = config
        # With replacement: without, a batch costs a permutation of the whole memory.
        rows = config.buffer_size // num_envs
        self._memory = RandomMemory(memory_size=rows, num_envs=num_envs, device="cpu", replacement=True)
        self._features = make_features(environment)
        # In each of two steps a drone acts on an observation, and another may end its flight.
        self._recent = RecentFeatures(self._features, 4 * num_envs)
        networks = sac_networks(config, self._features.space())
        self._policy = networks.policy
        self._agent = sac_agent(config, networks, self._memory)
        self._update = SacUpdate(config, self._agent, networks, self._memory)

    def act(self, observations: Float32Array, *, explore: bool) -> Float32Array:
        """Velocities (n, 3), drawn from the policy or its best."""
        return self._policy.velocities(self._recent.of(observations), explore=explore)

    def observe(self, transition: Transition) -> None:
        """Keep a step of every drone; a truncated one is bootstrapped from its final observation, a crash is not."""
        samples: dict[str, Any] = self._samples(transition, self._recent.of)
        self._memory.add_samples(**samples)
        self._observed += len(transition.rewards)

    def learn(self) -> Statistics:
        """Make the updates that are due since the memory held its first batch."""
        due = int((self._observed - self._config.batch_size) * self._config.updates_per_step) - self.updates
        if due <= 0:
            return {}
        told = self._update(due)
        self.updates += due
        return dict(zip(STATISTICS, np.mean(told, axis=0).tolist(), strict=True))

    def state(self) -> dict[str, Any]:
        """The state beside the weights and the transitions in memory; see `Learner.state`."""
        return {
            "optimizers": optimizers_state(self._agent),
            "log_entropy_coefficient": self._agent.log_entropy_coefficient.detach().clone(),
            "memory_index": self._memory.memory_index,
            "memory_filled": self._memory.filled,
            "observed": self._observed,
            "updates": self.updates,
            "random": random_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        restore_optimizers(self._agent, state["optimizers"])
        with torch.no_grad():
            # In place: the optimiser holds this very tensor.
            self._agent.log_entropy_coefficient.copy_(state["log_entropy_coefficient"])
        self._update.begin()
        self._memory.memory_index, self._memory.filled = state["memory_index"], state["memory_filled"]
        self._observed, self.updates = state["observed"], state["updates"]
        restore_random_state(state["random"])

    @property
    def memory_steps(self) -> int:
        """How many of the last steps of all drones are in memory."""
        return self._memory.memory_size if self._memory.filled else self._memory.memory_index

    def recall(self, steps: Iterable[Transition]) -> None:
        """Put the last `memory_steps` back where they were."""
        size = self._memory.memory_size
        place = self._memory.memory_index - self.memory_steps
        for transition in steps:
            places = torch.arange(place, place + len(transition.rewards)) % size
            for name, samples in self._samples(transition, self._features_of).items():
                self._memory.tensors[name][places] = samples
            place += len(transition.rewards)

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of the policy and the critics."""
        return network_weights(self._agent)

    def load_weights(self, weights: dict[str, NDArray[Any]]) -> None:
        """Take another learner's parameters."""
        load_network_weights(self._agent, weights)

    def _samples(
        self, transition: Transition, features_of: Callable[[Float32Array], Float32Array]
    ) -> dict[str, Tensor]:
        """As they are kept: of one step of all drones, or of several in their order."""
        config = self._config
        kept = {
            "observations": features_of(transition.observations),
            "next_observations": features_of(transition.next_observations),
            "actions": transition.actions,
            "rewards": learned_rewards(transition.rewards, config.reward_floor, config.reward_scale)[..., None],
            "terminated": transition.terminated[..., None],
        }
        # Fields of a journal's rows lie apart from each other, which torch can't share.
        return {name: torch.from_numpy(np.require(array, requirements=["C", "W"])) for name, array in kept.items()}

    def _features_of(self, observations: Float32Array) -> Float32Array:
        """Of many; any leading axes."""
        rows = observations.reshape(-1, observations.shape[-1])
        pieces = [rows[first : first + _FEATURES_AT_ONCE] for first in range(0, len(rows), _FEATURES_AT_ONCE)]
        features = np.concatenate([self._features.of(piece) for piece in pieces])
        return features.reshape(*observations.shape[:-1], self._features.size)


def sac_networks(config: SacConfig, features: Box) -> SacNetworks:
    spaces = (features, action_space())
    policy = SquashedPolicy(*spaces, config.hidden_sizes)
    first, second, first_target, second_target = (Critic(*spaces, config.hidden_sizes) for _ in range(4))
    return SacNetworks(policy=policy, critics=(first, second), targets=(first_target, second_target))


def sac_agent(config: SacConfig, networks: SacNetworks, memory: Memory) -> SAC:
    """skrl's agent, which makes the optimisers and initialises the targets from their critics."""
    models: dict[str, Model] = {"policy": networks.policy}
    for number, (critic, target) in enumerate(zip(networks.critics, networks.targets, strict=True), start=1):
        models |= {f"critic_{number}": critic, f"target_critic_{number}": target}
    agent = SAC(
        models=models,
        memory=memory,
        cfg=_settings(config),
        device="cpu",
        observation_space=networks.policy.observation_space,
        action_space=action_space(),
    )
    agent.init()
    return agent


def _settings(config: SacConfig) -> SAC_CFG:
    settings = SAC_CFG(
        batch_size=config.batch_size,
        discount_factor=config.gamma,
        polyak=config.tau,
        learning_rate=config.learning_rate,
        initial_entropy_value=config.initial_ent_coef,
    )
    settings.experiment.write_interval = settings.experiment.checkpoint_interval = 0
    return settings
