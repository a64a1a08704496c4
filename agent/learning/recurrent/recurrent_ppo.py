"""Recurrent proximal policy optimisation, our own. See docs/decisions/0309-our-own-recurrent-ppo.md.

The actor's state of a step is kept as the step was drawn with it. The critic's is computed when a rollout is whole: its
values are not needed before.
"""

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from msgspec import Struct
from numpy.typing import NDArray
from torch import Tensor

from agent.learning.learner import Statistics, Transition
from agent.learning.randomness import random_state, restore_random_state, seed_all
from agent.learning.recurrent.network import RecurrentNetwork
from agent.learning.recurrent.policy import ACTOR, RecurrentPolicy, drawn, log_prob, new_actor
from agent.learning.recurrent.rollout import Rollout, Steps, advantages, worth
from agent.learning.recurrent.schedule import linear_schedule
from agent.learning.recurrent.update import RecurrentPpoUpdate
from agent.learning.weights import load_weights_into, weights_of
from protocol.arrays import Float32Array
from protocol.errors import InvalidInput
from protocol.learner_config import RecurrentPpoConfig


class _UnderWay(Struct, frozen=True, eq=False):
    """An action that was chosen and is not yet observed.

    Attributes:
        observations: (n, 20) that it was chosen for.
        starts: (n,) whether an episode starts with them.
        state: (2, l, n, h) the actor's before them.
        actions, log_probs: (n,).
    """

    observations: Tensor
    starts: Tensor
    state: Tensor
    actions: Tensor
    log_probs: Tensor


class RecurrentPpoLearner:
    """Learns from the steps of its own last rollout, each `n_steps` steps of every drone.

    Where an action is under way while it learns, that action was drawn from the policy before. It goes into the next
    rollout with the log-probability it was drawn with, so the ratio that is clipped stays right. What the new policy
    remembers after it is computed anew, so the ratios of all other steps begin at 1.
    """

    off_policy = False
    memory_steps = 0

    def __init__(self, config: RecurrentPpoConfig, num_envs: int, *, seed: int) -> None:
        config.require_minibatches(num_envs)
        torch.set_num_threads(1)
        seed_all(seed)
        self.updates = 0
        self._config = config
        self._num_envs = num_envs
        self._observed = 0
        self._actor = new_actor(config)
        self._critic = RecurrentNetwork(config, 1, head_gain=1.0)
        self._update = RecurrentPpoUpdate(config, self._actor, self._critic)
        self._policy = RecurrentPolicy(self._actor)
        self._policy.start(num_envs)
        self._starts = torch.ones(num_envs, dtype=torch.bool)
        self._under_way: _UnderWay | None = None
        self._steps: list[Steps] = []
        self._actor_state = self._policy.state
        self._critic_state = self._critic.start(num_envs)

    def act(self, observations: Float32Array, *, explore: bool) -> NDArray[np.int64]:
        """Moves (n,), drawn from the policy or its most probable ones."""
        rows = torch.tensor(observations)
        if not explore:
            return self._policy.copy().step(rows, self._starts).argmax(1).numpy()
        state = self._policy.state
        logits = self._policy.step(rows, self._starts)
        actions = drawn(logits)
        self._under_way = _UnderWay(rows, self._starts, state, actions, log_prob(logits, actions))
        return actions.numpy().copy()

    def observe(self, transition: Transition) -> None:
        """Keep the step that followed the last `act`."""
        begun = self._under_way
        if begun is None:
            raise InvalidInput("a step was observed whose actions this learner did not choose")
        if not self._steps:
            self._actor_state = begun.state
        step = Steps(
            observations=begun.observations,
            starts=begun.starts,
            actions=begun.actions,
            log_probs=begun.log_probs,
            rewards=torch.tensor(transition.rewards * self._config.reward_scale, dtype=torch.float32),
            next_observations=torch.tensor(transition.next_observations),
            terminated=torch.tensor(transition.terminated),
            truncated=torch.tensor(transition.truncated),
        )
        self._steps.append(step)
        self._under_way = None
        self._starts = step.terminated | step.truncated
        self._observed += 1

    def learn(self) -> Statistics:
        """Make the updates of a rollout once it is whole."""
        if len(self._steps) < self._config.n_steps:
            return {}
        ent_coef, learning_rate = self._ent_coef, self._learning_rate
        statistics = self._update(self._rollout(), ent_coef=ent_coef, learning_rate=learning_rate)
        self.updates += self._config.n_epochs * self._config.minibatches
        self._steps = []
        self._remember_anew()
        scheduled = {"Coefficient / Entropy coefficient": ent_coef, "Learning / Learning rate": learning_rate}
        return {**statistics, **scheduled}

    def state(self) -> dict[str, Any]:
        """The state beside the weights, a rollout under way included; see `Learner.state`."""
        begun = self._under_way
        state = {
            "optimizer": self._update.optimizer.state_dict(),
            "steps": [step.as_dict() for step in self._steps],
            "under_way": begun and {name: getattr(begun, name) for name in begun.__struct_fields__},
            "starts": self._starts,
            "policy_state": self._policy.state,
            "actor_state": self._actor_state,
            "critic_state": self._critic_state,
            "observed": self._observed,
            "updates": self.updates,
            "random": random_state(),
        }
        return copy.deepcopy(state)

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        state = copy.deepcopy(state)
        self._update.optimizer.load_state_dict(state["optimizer"])
        self._update.begin()
        self._steps = [Steps(**step) for step in state["steps"]]
        self._under_way = None if state["under_way"] is None else _UnderWay(**state["under_way"])
        self._starts, self._policy.state = state["starts"], state["policy_state"]
        self._actor_state, self._critic_state = state["actor_state"], state["critic_state"]
        self._observed, self.updates = state["observed"], state["updates"]
        restore_random_state(state["random"])

    def recall(self, steps: Iterable[Transition]) -> None:
        """Nothing: what it learns from is in its own state."""

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of actor and critic."""
        return weights_of(self._networks)

    def load_weights(self, weights: dict[str, NDArray[Any]]) -> None:
        """Take another learner's parameters."""
        load_weights_into(self._networks, weights)

    @property
    def _networks(self) -> dict[str, RecurrentNetwork]:
        return {ACTOR: self._actor, "critic": self._critic}

    @property
    def _ent_coef(self) -> float:
        config = self._config
        return linear_schedule(
            self._env_steps, first=config.ent_coef, last=config.final_ent_coef, over=config.ent_coef_steps
        )

    @property
    def _learning_rate(self) -> float:
        config = self._config
        return linear_schedule(
            self._env_steps,
            first=config.learning_rate,
            last=config.final_learning_rate,
            over=config.learning_rate_steps,
        )

    @property
    def _env_steps(self) -> int:
        return self._observed * self._num_envs

    @torch.no_grad()
    def _rollout(self) -> Rollout:
        """What was observed, with what it was worth; the critic goes on from after it."""
        config, steps = self._config, Steps.stacked(self._steps)
        valued = worth(self._critic, steps, self._critic_state)
        over = steps.terminated | steps.truncated
        estimates = advantages(
            steps.rewards, valued.before, valued.after, over, gamma=config.gamma, gae_lambda=config.gae_lambda
        )
        rollout = Rollout(
            steps=steps,
            actor_state=self._actor_state,
            critic_state=self._critic_state,
            advantages=(estimates - estimates.mean()) / (estimates.std() + 1e-8),
            returns=estimates + valued.before,
        )
        self._critic_state = valued.state
        return rollout

    def _remember_anew(self) -> None:
        """Remember by the new weights what the action that is under way was chosen for."""
        if (begun := self._under_way) is not None:
            self._policy.state = begun.state
            self._policy.step(begun.observations, begun.starts)
