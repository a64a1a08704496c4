"""The agent's SAC on another device: skrl's agent, with the agent's own networks and settings.

The agent itself learns on the CPU; this measures what another device would gain.
"""

from typing import Any

import torch
from numpy.typing import NDArray
from skrl.agents.torch.sac import SAC, SAC_CFG
from skrl.memories.torch import RandomMemory
from skrl.models.torch import Model

from agent.environment.spaces import action_space, observation_space
from agent.learning.features import Features
from agent.learning.learner import Transition, learned_rewards
from agent.learning.networks import Critic, SquashedPolicy
from agent.learning.randomness import seed_all
from agent.learning.skrl_state import network_weights, tracked
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import SacConfig

_CRITICS = ("critic_1", "critic_2", "target_critic_1", "target_critic_2")


class SacOnDevice:
    """Learns from all transitions in its memory, `updates_per_step` for each one observed."""

    def __init__(self, config: SacConfig, environment: EnvironmentConfig, *, seed: int, device: str) -> None:
        seed_all(seed)
        self.updates = 0
        self._observed = 0
        self._config = config
        self._device = torch.device(device)
        rows = config.buffer_size // environment.num_envs
        self._memory = RandomMemory(memory_size=rows, num_envs=environment.num_envs, device=device, replacement=True)
        # The features make constants of their own, where torch puts what says nothing else. Not for the updates:
        # Adam would keep its counts on a GPU, and wait for each of them.
        with self._device:
            self._agent = self._made_agent(environment)

    def observe(self, transition: Transition) -> None:
        """Keep a step of every drone."""
        config = self._config
        rewards = learned_rewards(transition.rewards, config.reward_floor, config.reward_scale)
        kept = {
            "observations": transition.observations,
            "actions": transition.actions,
            "rewards": rewards[..., None],
            "next_observations": transition.next_observations,
            "terminated": transition.terminated[..., None],
        }
        samples: dict[str, Any] = {name: torch.as_tensor(array, device=self._device) for name, array in kept.items()}
        self._memory.add_samples(**samples)
        self._observed += len(transition.rewards)

    def learn(self) -> None:
        """Make the updates that are due, and wait until the device is through with them."""
        due = int((self._observed - self._config.batch_size) * self._config.updates_per_step) - self.updates
        for _ in range(due):
            self._agent.update(timestep=self.updates, timesteps=0)
            self.updates += 1
        tracked(self._agent)
        if self._device.type == "cuda":
            torch.cuda.synchronize()

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of the policy and the critics."""
        return network_weights(self._agent)

    def _made_agent(self, environment: EnvironmentConfig) -> SAC:
        config, spaces = self._config, (Features.space(), action_space())
        models: dict[str, Model] = {"policy": SquashedPolicy(*spaces, config.hidden_sizes)}
        models |= {name: Critic(*spaces, config.hidden_sizes) for name in _CRITICS}
        for model in models.values():
            model.device = self._device
            model.to(self._device)
        settings = SAC_CFG(
            batch_size=config.batch_size,
            discount_factor=config.gamma,
            polyak=config.tau,
            learning_rate=config.learning_rate,
            initial_entropy_value=config.initial_ent_coef,
            observation_preprocessor=Features,
            observation_preprocessor_kwargs={"workspace": environment},
        )
        settings.experiment.write_interval = settings.experiment.checkpoint_interval = 0
        agent = SAC(
            models=models,
            memory=self._memory,
            cfg=settings,
            device=str(self._device),
            observation_space=observation_space(),
            action_space=action_space(),
        )
        agent.init()
        agent.write_interval = 1
        return agent
