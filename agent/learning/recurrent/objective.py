"""What an update improves: the clipped surrogate, the entropy bonus, the value's squared error.

Source: Schulman et al., Proximal policy optimization algorithms, 2017, equations 7 and 9.
"""

from typing import Self

from msgspec import Struct
from torch import Tensor

from agent.learning.recurrent.policy import log_prob


class PolicyLoss(Struct, frozen=True, eq=False):
    """Of a minibatch.

    Attributes:
        surrogate: minus the clipped surrogate objective.
        entropy: the policy's mean entropy, nats.
        ratios: (…) each action's probability, relative to that when it was drawn.
    """

    surrogate: Tensor
    entropy: Tensor
    ratios: Tensor

    def total(self, ent_coef: float) -> Tensor:
        """With the entropy bonus."""
        return self.surrogate - ent_coef * self.entropy

    def detached(self) -> Self:
        """Without autograd's graph."""
        return type(self)(self.surrogate.detach(), self.entropy.detach(), self.ratios.detach())


def policy_loss(
    logits: Tensor, actions: Tensor, log_probs: Tensor, advantages: Tensor, *, clip_range: float
) -> PolicyLoss:
    """The loss of logits (…, 8) for actions (…) that were drawn with `log_probs` (…)."""
    ratios = (log_prob(logits, actions) - log_probs).exp()
    clipped = ratios.clamp(1.0 - clip_range, 1.0 + clip_range)
    surrogate = -(ratios * advantages).minimum(clipped * advantages).mean()
    return PolicyLoss(surrogate, entropy(logits), ratios)


def entropy(logits: Tensor) -> Tensor:
    """The mean entropy of the policies of logits (…, 8), nats."""
    log_probs = logits.log_softmax(-1)
    return -(log_probs.exp() * log_probs).sum(-1).mean()


def value_loss(values: Tensor, returns: Tensor) -> Tensor:
    """The mean squared error."""
    return (values - returns).square().mean()
