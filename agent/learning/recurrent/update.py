"""The gradient updates of a rollout: some epochs of minibatches of whole drones."""

from collections.abc import Iterator

import torch
from torch import Tensor
from torch.nn.utils import clip_grad_norm_
from torch.optim import Adam

from agent.learning.fused_adam import FusedAdam
from agent.learning.learner import Statistics
from agent.learning.recurrent.network import RecurrentNetwork
from agent.learning.recurrent.objective import PolicyLoss, policy_loss, value_loss
from agent.learning.recurrent.rollout import Rollout
from protocol.learner_config import RecurrentPpoConfig

_ADAM_EPSILON = 1e-5
"""As in SB3's PPO, which the thesis used; torch's own is smaller."""


_DEVIATION = "Policy / Largest deviation of a ratio from 1 before the updates"

STATISTICS = (
    "Loss / Policy loss",
    "Loss / Value loss",
    "Policy / Entropy",
    "Policy / Divergence",
    "Policy / Clipped share",
    _DEVIATION,
)
"""Of an update, by skrl's names where it has them; the last one is that of the first update alone."""


class RecurrentPpoUpdate:
    """Improves an actor and a critic.

    Both have one optimiser and one limit on the norm of their gradients, as in SB3: so `vf_coef` means what it means
    there.
    """

    def __init__(self, config: RecurrentPpoConfig, actor: RecurrentNetwork, critic: RecurrentNetwork) -> None:
        self._config = config
        self._actor, self._critic = actor, critic
        self._parameters = [*actor.parameters(), *critic.parameters()]
        self.optimizer = Adam(self._parameters, lr=config.learning_rate, eps=_ADAM_EPSILON, fused=True)
        self.begin()

    def begin(self) -> None:
        """Take up the optimiser as it is now, after it was restored, say."""
        self._adam = FusedAdam(self.optimizer)

    @torch.no_grad()
    def __call__(self, rollout: Rollout, *, ent_coef: float, learning_rate: float) -> Statistics:
        """Make all updates of a rollout; returns the means of their statistics."""
        self._adam.learning_rate = learning_rate
        statistics = torch.stack([self._learn(minibatch, ent_coef) for minibatch in self._minibatches(rollout)])
        means = dict(zip(STATISTICS, statistics.mean(0).tolist(), strict=True))
        return {**means, _DEVIATION: statistics[0, -1].item()}

    def _minibatches(self, rollout: Rollout) -> Iterator[Rollout]:
        drones = rollout.returns.shape[1]
        size = drones // self._config.minibatches
        for _ in range(self._config.n_epochs):
            for some in torch.randperm(drones).split(size):
                yield rollout.of_drones(some)

    def _learn(self, minibatch: Rollout, ent_coef: float) -> Tensor:
        """Make an update; its `STATISTICS`."""
        loss = self._set_actor_gradients(minibatch, ent_coef)
        of_values = self._set_critic_gradients(minibatch)
        clip_grad_norm_(self._parameters, self._config.max_grad_norm)
        self._adam.step()
        apart = (loss.ratios - 1.0).abs()
        divergence = loss.ratios - 1.0 - loss.ratios.log()
        clipped = (apart > self._config.clip_range).float()
        return torch.stack([loss.surrogate, of_values, loss.entropy, divergence.mean(), clipped.mean(), apart.max()])

    def _set_actor_gradients(self, minibatch: Rollout, ent_coef: float) -> PolicyLoss:
        steps = minibatch.steps
        sequence = self._actor.run(steps.observations, steps.starts, minibatch.actor_state)
        with torch.enable_grad():
            logits = sequence.outputs.requires_grad_()
            loss = policy_loss(
                logits, steps.actions, steps.log_probs, minibatch.advantages, clip_range=self._config.clip_range
            )
            (gradient,) = torch.autograd.grad(loss.total(ent_coef), logits)
        self._actor.backpropagate(sequence, gradient)
        return loss.detached()

    def _set_critic_gradients(self, minibatch: Rollout) -> Tensor:
        steps = minibatch.steps
        sequence = self._critic.run(steps.observations, steps.starts, minibatch.critic_state)
        with torch.enable_grad():
            values = sequence.outputs.requires_grad_()
            loss = value_loss(values.squeeze(-1), minibatch.returns)
            (gradient,) = torch.autograd.grad(self._config.vf_coef * loss, values)
        self._critic.backpropagate(sequence, gradient)
        return loss.detach()
