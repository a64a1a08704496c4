"""Draws of `SquashedPolicy` from its network's outputs, with their gradient written out.

The network gives mean and spread in the drone's frame, the velocity is in the world's; tanh keeps it within its limits.
"""

import math
from typing import Self

import torch
from msgspec import Struct
from torch import Tensor

from agent.learning.networks import HALF_LOG_STD, MIN_LOG_STD, log_squashing

_LOG_NORMALIZER = 0.5 * math.log(2.0 * math.pi)


class SquashedGaussian(Struct, frozen=True, eq=False):
    """A batch of drawn velocities.

    Attributes:
        frames: (n, 3, 3) rotations from the world to each drone's frame.
        squashed: (n, 3) tanh of the network's output for the spread.
        scaled_noise: (n, 3) standard deviation times the standard noise that was drawn.
        actions: (n, 3) the velocities.
        log_prob: (n, 1) of the velocities.
    """

    frames: Tensor
    squashed: Tensor
    scaled_noise: Tensor
    actions: Tensor
    log_prob: Tensor

    @classmethod
    def drawn(cls, outputs: Tensor, frames: Tensor, noise: Tensor) -> Self:
        """From the network's outputs (n, 6) and standard normal noise (n, 3)."""
        # Halves of rows are slow to go through one number after the other.
        mean, spread = (half.contiguous() for half in outputs.chunk(2, dim=1))
        squashed = torch.tanh(spread)
        log_std = MIN_LOG_STD + HALF_LOG_STD * (squashed + 1.0)
        scaled_noise = log_std.exp() * noise
        unsquashed = rotated(mean, frames.mT) + scaled_noise
        log_prob = -0.5 * noise.square() - log_std - _LOG_NORMALIZER - log_squashing(unsquashed)
        return cls(frames, squashed, scaled_noise, torch.tanh(unsquashed), log_prob.sum(1, keepdim=True))

    def outputs_gradient(self, of_actions: Tensor, of_log_prob: Tensor | float) -> Tensor:
        """(n, 6) the gradient of the network's outputs, from those of the velocities (n, 3) and their log-probability.

        The noise stays as it was drawn. So the normal log-density falls as much as the logarithm of the spread grows.
        All else comes by way of tanh; the logarithm of its derivative, 1 - tanh², has the derivative -2 tanh.
        """
        of_unsquashed = of_actions * (1.0 - self.actions.square()) + 2.0 * of_log_prob * self.actions
        of_log_std = of_unsquashed * self.scaled_noise - of_log_prob
        of_spread = of_log_std * HALF_LOG_STD * (1.0 - self.squashed.square())
        return torch.cat([rotated(of_unsquashed, self.frames), of_spread], dim=1)

    def split(self, size: int) -> tuple[Self, Self]:
        """The first `size` of the batch, and the rest."""
        fields = [getattr(self, name).tensor_split([size]) for name in self.__struct_fields__]
        first, rest = zip(*fields, strict=True)
        return type(self)(*first), type(self)(*rest)


def rotated(vectors: Tensor, frames: Tensor) -> Tensor:
    """Each of (n, 3) vectors in its own of (n, 3, 3) frames."""
    return torch.bmm(frames, vectors[:, :, None])[:, :, 0]
