"""The steps of all drones between two updates, and what each was worth."""

from typing import Any, Self

import torch
from msgspec import Struct
from torch import Tensor

from agent.learning.recurrent.network import RecurrentNetwork


class Steps(Struct, frozen=True, eq=False, kw_only=True):
    """One step of n drones; or t of them, with an axis for that before the others.

    Attributes:
        observations: (n, 20) before the step.
        starts: (n,) whether an episode starts with it.
        actions: (n,).
        log_probs: (n,) of the actions when they were drawn.
        rewards: (n,), scaled.
        next_observations: (n, 20) after the step; the last one of an episode that ended.
        terminated: (n,) nothing comes after.
        truncated: (n,) more would have come.
    """

    observations: Tensor
    starts: Tensor
    actions: Tensor
    log_probs: Tensor
    rewards: Tensor
    next_observations: Tensor
    terminated: Tensor
    truncated: Tensor

    @classmethod
    def stacked(cls, steps: list[Self]) -> Self:
        """Several steps with an axis for them."""
        return cls(**{name: torch.stack([getattr(step, name) for step in steps]) for name in cls.__struct_fields__})

    def as_dict(self) -> dict[str, Any]:
        """The tensors by name."""
        return {name: getattr(self, name) for name in self.__struct_fields__}


class Worth(Struct, frozen=True, eq=False):
    """What a critic says of steps (t, n).

    Attributes:
        before: (t, n) the value of the observation before a step.
        after: (t, n) of that after it; 0 where the episode terminated.
        state: (2, l, n, h) the critic's, after the last step.
    """

    before: Tensor
    after: Tensor
    state: Tensor


def worth(critic: RecurrentNetwork, steps: Steps, state: Tensor) -> Worth:
    """The values before and after steps (t, n), with the critic's state before the first.

    The observation after a step is mostly the one before the next. Where it is not, at a truncation and at the end of
    the rollout, the critic gets it with the state that it has then, in a step aside.
    """
    sequence = critic.run(steps.observations, steps.starts, state)
    before = sequence.outputs[..., 0]
    aside = steps.truncated.clone()
    aside[-1] = True
    times, drones = aside.nonzero(as_tuple=True)
    no_starts = torch.zeros(1, len(times), dtype=torch.bool)
    ends = critic.run(steps.next_observations[times, drones][None], no_starts, sequence.states_after(times, drones))
    after = before.roll(-1, 0)
    after[times, drones] = ends.outputs[0, :, 0]
    return Worth(before, after.masked_fill_(steps.terminated, 0.0), sequence.last_state)


def advantages(
    rewards: Tensor, before: Tensor, after: Tensor, over: Tensor, *, gamma: float, gae_lambda: float
) -> Tensor:
    """(t, n) generalised advantage estimates; nothing comes back over the end of an episode.

    Args:
        rewards, before, after: (t, n) of each step; see `Worth`.
        over: (t, n) whether an episode ended with a step.

    Source: Schulman et al., 2016, equation 16.
    """
    surprises = rewards + gamma * after - before
    discounts = gamma * gae_lambda * (~over).to(rewards.dtype)
    estimates = torch.empty_like(surprises)
    following = torch.zeros_like(surprises[0])
    for step in reversed(range(len(surprises))):
        following = surprises[step] + discounts[step] * following
        estimates[step] = following
    return estimates


class Rollout(Struct, frozen=True, eq=False, kw_only=True):
    """What an update learns from: steps (t, n) of every drone, or of some.

    Attributes:
        actor_state, critic_state: (2, l, n, h) before the first step.
        advantages, returns: (t, n).
    """

    steps: Steps
    actor_state: Tensor
    critic_state: Tensor
    advantages: Tensor
    returns: Tensor

    def of_drones(self, drones: Tensor) -> Self:
        """All steps of some drones."""
        return type(self)(
            steps=Steps(**{name: tensor.index_select(1, drones) for name, tensor in self.steps.as_dict().items()}),
            actor_state=self.actor_state.index_select(2, drones),
            critic_state=self.critic_state.index_select(2, drones),
            advantages=self.advantages.index_select(1, drones),
            returns=self.returns.index_select(1, drones),
        )
