"""The gradient update of soft actor-critic with its gradients written out: skrl's numbers, in less than half its time.

skrl's own update is general; at this size it spends its time not on arithmetic but on autograd's graph, optimisers that
go from parameter to parameter, and gradients that are not used. See docs/decisions/0307-the-update-is-written-out.md.
"""

from collections.abc import Iterator

import torch
from msgspec import Struct
from skrl.agents.torch.sac import SAC
from skrl.memories.torch import Memory
from torch import Tensor
from torch.optim.swa_utils import get_ema_multi_avg_fn

from agent.environment.spaces import ACTION_SIZE
from agent.learning.backpropagation import Backpropagation
from agent.learning.features import to_drone_frames
from agent.learning.fused_adam import FusedAdam
from agent.learning.networks import Critic, SquashedPolicy
from agent.learning.squashed_gaussian import SquashedGaussian, rotated
from protocol.learner_config import SacConfig

_VALUES = ("Q-network / Q1", "Q-network / Q2", "Target / Target")

STATISTICS = (
    "Loss / Policy loss",
    "Loss / Critic loss",
    "Loss / Entropy loss",
    "Coefficient / Entropy coefficient",
    *(f"{of} ({kind})" for kind in ("min", "max", "mean") for of in _VALUES),
)
"""The statistics of an update, by skrl's names."""


_AT_ONCE = 8
"""Updates whose transitions are gathered together: one at a time costs more, and many take memory."""


class SacNetworks(Struct, frozen=True, eq=False, kw_only=True):
    """A policy, two critics, and the two that follow them slowly."""

    policy: SquashedPolicy
    critics: tuple[Critic, Critic]
    targets: tuple[Critic, Critic]


class _Batch(Struct, frozen=True, eq=False):
    """Transitions, with everything that an update needs and no network computes.

    Attributes:
        features: (2 n, f) after the transitions, then before them.
        frames: (2 n, 3, 3) rotations from the world to the drone's frame in these.
        noise: (2 n, 3) standard normal, for velocities in these.
        taken: (n, 3) the velocities that were flown, in the drones' frames.
        rewards: (n, 1).
        discounts: (n, 1) of what comes after; zero where nothing does.
    """

    features: Tensor
    frames: Tensor
    noise: Tensor
    taken: Tensor
    rewards: Tensor
    discounts: Tensor


class SacUpdate:
    """Updates an agent's networks and its entropy coefficient with its optimisers, several times a call.

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
        self._follow = get_ema_multi_avg_fn(1.0 - config.tau)
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
    def __call__(self, updates: int) -> list[list[float]]:
        """Make `updates` updates; returns `STATISTICS` of each."""
        pieces = (min(_AT_ONCE, updates - made) for made in range(0, updates, _AT_ONCE))
        return [told for piece in pieces for told in self._made(piece)]

    def _made(self, updates: int) -> list[list[float]]:
        losses, values = zip(*map(self._learn, self._batches(updates)), strict=True)
        return _statistics(torch.stack(losses), torch.stack(values))

    def _learn(self, batch: _Batch) -> tuple[Tensor, Tensor]:
        """Make an update; its losses (4,) and the values (n, 3) that they are of."""
        drawn = SquashedGaussian.drawn(self._policy.forward(batch.features), batch.frames, batch.noise)
        after, before = drawn.split(len(batch.rewards))
        after_inputs, before_inputs = _critic_inputs(batch.features, rotated(drawn.actions, batch.frames)).chunk(2)
        targets = self._target_values(batch, after_inputs, after.log_prob)
        critic_loss = self._step_critics(batch, targets)
        policy_loss, values = self._step_policy(before_inputs, before)
        entropy_loss = self._step_entropy(before.log_prob)
        self._follow(self._following, self._followed, 1)
        losses = [policy_loss, critic_loss, entropy_loss, self._entropy]
        return torch.cat(losses), torch.cat([*values, targets], dim=1)

    def _batches(self, updates: int) -> Iterator[_Batch]:
        """As skrl's memory draws with replacement; what needs no network is computed for all of them at once."""
        size = self._config.batch_size
        rows, noise = zip(*(self._draws() for _ in range(updates)), strict=True)
        kept = self._gathered(torch.cat(rows))
        both = [kept[name].unflatten(0, (updates, size)) for name in ("next_observations", "observations")]
        features = torch.cat(both, dim=1)
        frames = to_drone_frames(features.flatten(0, 1)).unflatten(0, (updates, 2 * size))
        taken = rotated(kept["actions"], frames[:, size:].flatten(0, 1))
        discounts = self._config.gamma * kept["terminated"].logical_not()
        parts = (part.split(size) for part in (taken, kept["rewards"], discounts))
        return map(_Batch, features, frames, noise, *parts)

    def _draws(self) -> tuple[Tensor, Tensor]:
        """(n,) rows of the memory for an update, and (2 n, 3) its noise."""
        size, kind = self._config.batch_size, self._log_entropy.dtype
        rows = torch.randint(0, len(self._memory), (size,))
        # Two draws, as skrl makes them: one of double the size need not give the same numbers.
        return rows, torch.cat([torch.randn(size, ACTION_SIZE, dtype=kind), torch.randn(size, ACTION_SIZE, dtype=kind)])

    def _gathered(self, rows: Tensor) -> dict[str, Tensor]:
        """Rows of the memory by name; `index_select` gathers them in a quarter of the time of `[]`."""
        return {name: kept.index_select(0, rows) for name, kept in self._memory.tensors_view.items()}

    def _target_values(self, batch: _Batch, inputs: Tensor, log_prob: Tensor) -> Tensor:
        """(n, 1) the critics' targets, from velocities drawn for the observations after the transitions."""
        first, second = (critic.forward(inputs) for critic in self._targets)
        return batch.rewards + batch.discounts * (torch.min(first, second) - self._entropy * log_prob)

    def _step_critics(self, batch: _Batch, targets: Tensor) -> Tensor:
        """Improve the critics; their loss before that, (1,)."""
        inputs = _critic_inputs(batch.features[len(targets) :], batch.taken)
        errors = torch.cat([critic.forward(inputs) for critic in self._critics], dim=1) - targets
        for critic, gradient in zip(self._critics, (errors / len(errors)).split(1, dim=1), strict=True):
            critic.backward(gradient)
        self._critic_optimizer.step()
        return errors.square().mean(0).mean(0, keepdim=True)

    def _step_policy(self, inputs: Tensor, before: SquashedGaussian) -> tuple[Tensor, list[Tensor]]:
        """Improve the policy; its loss before that, (1,), and both critics' values (n, 1) of what it drew."""
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
        columns = slice(-ACTION_SIZE, None)
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


def _critic_inputs(features: Tensor, velocities: Tensor) -> Tensor:
    """(n, f + 3) the input of `Critic`'s network: features, and velocities in the drones' frames."""
    return torch.cat([features, velocities], dim=1)


def _statistics(losses: Tensor, values: Tensor) -> list[list[float]]:
    """`STATISTICS` of each update, from losses (k, 4) and values (k, n, 3); read all at once."""
    lowest, highest = torch.aminmax(values, dim=1)
    return torch.cat([losses, lowest, highest, values.mean(1)], dim=1).tolist()
