"""The gradient update of soft actor-critic with its gradients written out: skrl's numbers, in less than half its time.

skrl's own update is general; what it costs at this size is not arithmetic but autograd's graph, optimisers that go from
parameter to parameter, and gradients that nobody reads. See docs/decisions/0307-the-update-is-written-out.md.
"""

import torch
from msgspec import Struct
from skrl.agents.torch.sac import SAC
from skrl.memories.torch import Memory
from torch import Tensor
from torch.optim.swa_utils import get_ema_multi_avg_fn

from agent.backpropagation import Backpropagation
from agent.features import FEATURE_SIZE, to_drone_frames
from agent.fused_adam import FusedAdam
from agent.networks import Critic, SquashedPolicy
from agent.spaces import ACTION_SIZE
from agent.squashed_gaussian import SquashedGaussian, rotated
from protocol.config import SacConfig

_VALUES = ("Q-network / Q1", "Q-network / Q2", "Target / Target")

STATISTICS = (
    "Loss / Policy loss",
    "Loss / Critic loss",
    "Loss / Entropy loss",
    "Coefficient / Entropy coefficient",
    *(f"{of} ({kind})" for kind in ("min", "max", "mean") for of in _VALUES),
)
"""What an update tells, by skrl's names."""


class SacNetworks(Struct, frozen=True, eq=False, kw_only=True):
    """A policy, two critics, and the two that follow them slowly."""

    policy: SquashedPolicy
    critics: tuple[Critic, Critic]
    targets: tuple[Critic, Critic]


class _Batch(Struct, frozen=True, eq=False):
    """Transitions as they are in memory: features (n, f) before and after, actions (n, 3), the rest (n, 1)."""

    observations: Tensor
    next_observations: Tensor
    actions: Tensor
    rewards: Tensor
    terminated: Tensor


class SacUpdate:
    """Updates an agent's networks and its entropy coefficient with its optimisers; a call is one update.

    Args:
        agent: of these networks and this memory, which holds features, not observations.
    """

    def __init__(self, config: SacConfig, agent: SAC, networks: SacNetworks, memory: Memory) -> None:
        self._config = config
        self._agent = agent
        self._memory = memory
        self._policy = Backpropagation(networks.policy.net)
        self._critics = [Backpropagation(critic.net) for critic in networks.critics]
        self._targets = [Backpropagation(critic.net) for critic in networks.targets]
        self._followed: list[Tensor] = [parameter for critic in networks.critics for parameter in critic.parameters()]
        self._following: list[Tensor] = [parameter for critic in networks.targets for parameter in critic.parameters()]
        self._follow = get_ema_multi_avg_fn(1.0 - config.polyak)
        self._log_entropy = agent.log_entropy_coefficient
        self._log_entropy.grad = self._entropy_gradient = torch.zeros_like(self._log_entropy)
        self.begin()

    def begin(self) -> None:
        """Take up the agent's entropy coefficient and its optimisers as they are now, after they were restored, say."""
        self._entropy = torch.exp(self._log_entropy.detach())
        self._critic_optimizer = FusedAdam(self._agent.critic_optimizer)
        self._policy_optimizer = FusedAdam(self._agent.policy_optimizer)
        self._entropy_optimizer = FusedAdam(self._agent.entropy_optimizer)

    @torch.inference_mode()
    def __call__(self) -> list[float]:
        """Make one and tell `STATISTICS` of it."""
        batch = self._sampled()
        after, before = self._drawn(batch).split(len(batch.rewards))
        targets = self._target_values(batch, after)
        critic_loss = self._step_critics(batch, before.frames, targets)
        policy_loss, values = self._step_policy(batch, before)
        entropy_loss = self._step_entropy(before.log_prob)
        self._follow(self._following, self._followed, 1)
        losses = [policy_loss, critic_loss, entropy_loss, self._entropy]
        return _statistics(torch.cat(losses), torch.cat([*values, targets], dim=1))

    def _sampled(self) -> _Batch:
        """As skrl's memory draws with replacement; `index_select` gathers rows in a quarter of the time of `[]`."""
        rows = torch.randint(0, len(self._memory), (self._config.batch,))
        kept = self._memory.tensors_view
        return _Batch(**{name: kept[name].index_select(0, rows) for name in _Batch.__struct_fields__})

    def _drawn(self, batch: _Batch) -> SquashedGaussian:
        """Velocities for after the transitions, and then for before them, by the policy as it is."""
        features = torch.cat([batch.next_observations, batch.observations])
        # Two draws, as skrl makes them: one of double the size need not give the same numbers.
        noise = torch.cat([torch.randn_like(batch.actions), torch.randn_like(batch.actions)])
        return SquashedGaussian.drawn(self._policy.forward(features), to_drone_frames(features), noise)

    def _target_values(self, batch: _Batch, after: SquashedGaussian) -> Tensor:
        """(n, 1) what the critics should have said."""
        inputs = _critic_inputs(batch.next_observations, after.actions, after.frames)
        first, second = (critic.forward(inputs) for critic in self._targets)
        values = torch.min(first, second) - self._entropy * after.log_prob
        return batch.rewards + self._config.discount * batch.terminated.logical_not() * values

    def _step_critics(self, batch: _Batch, frames: Tensor, targets: Tensor) -> Tensor:
        """Improve the critics; their loss before that, (1,)."""
        inputs = _critic_inputs(batch.observations, batch.actions, frames)
        errors = torch.cat([critic.forward(inputs) for critic in self._critics], dim=1) - targets
        for critic, gradient in zip(self._critics, (errors / len(errors)).split(1, dim=1), strict=True):
            critic.backward(gradient)
        self._critic_optimizer.step()
        return errors.square().mean(0).mean(0, keepdim=True)

    def _step_policy(self, batch: _Batch, before: SquashedGaussian) -> tuple[Tensor, list[Tensor]]:
        """Improve the policy; its loss before that, (1,), and both critics' values (n, 1) of what it drew."""
        inputs = _critic_inputs(batch.observations, before.actions, before.frames)
        values = [critic.forward(inputs) for critic in self._critics]
        of_actions = rotated(self._steepest(*values), before.frames.mT)
        gradient = before.outputs_gradient(of_actions, self._entropy / len(inputs))
        self._policy.backward(gradient, rows=slice(len(inputs), None))
        self._policy_optimizer.step()
        return (self._entropy * before.log_prob - torch.min(*values)).mean(0), values

    def _steepest(self, first: Tensor, second: Tensor) -> Tensor:
        """(n, 3) the gradient of minus the mean of the lower of two values, by velocities in the drones' frames."""
        # Where they agree, half of each.
        lower = (0.5 + 0.5 * (second - first).sign()) / len(first)
        columns = slice(FEATURE_SIZE, None)
        of_first = self._critics[0].input_gradient(-lower, columns)
        return of_first + self._critics[1].input_gradient(lower - 1.0 / len(first), columns)

    def _step_entropy(self, log_prob: Tensor) -> Tensor:
        """Pay more for entropy where there is less of it than wanted, 3 nats below zero; the loss before that, (1,)."""
        excess = log_prob.mean(0) - ACTION_SIZE
        loss = -self._log_entropy * excess
        torch.neg(excess, out=self._entropy_gradient)
        self._entropy_optimizer.step()
        self._entropy = torch.exp(self._log_entropy)
        return loss


def _critic_inputs(features: Tensor, actions: Tensor, frames: Tensor) -> Tensor:
    """(n, f + 3) what `Critic` gives its network: features, and the velocities in the drones' frames."""
    return torch.cat([features, rotated(actions, frames)], dim=1)


def _statistics(losses: Tensor, values: Tensor) -> list[float]:
    """`STATISTICS` from losses (4,) and values (n, 3); read all at once."""
    lowest, highest = torch.aminmax(values, dim=0)
    return torch.cat([losses, lowest, highest, values.mean(0)]).tolist()
