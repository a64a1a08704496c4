"""The networks of the learners, in skrl's terms: policies and critics over the features of an observation."""

import itertools
import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812 (torch's own name for it)
from gymnasium.spaces import Box
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from torch import Tensor, nn
from torch.distributions import Normal

from agent.environment.spaces import ACTION_SIZE
from agent.learning.features import bearing_of, to_drone_frame, to_world_frame
from protocol.arrays import Float32Array

Inputs: TypeAlias = dict[str, Any]
Output: TypeAlias = tuple[Tensor, dict[str, Any]]

# skrl's mixins pass `role` to `compute` by position, against its own base class; hence the ignored complaints below.

MIN_LOG_STD, MAX_LOG_STD = -5.0, 2.0
HALF_LOG_STD = 0.5 * (MAX_LOG_STD - MIN_LOG_STD)


def layers(inputs: int, hidden: Sequence[int], outputs: int) -> nn.Sequential:
    """A plain network with ReLU between its layers."""
    sizes = [inputs, *hidden]
    between = [part for pair in itertools.pairwise(sizes) for part in (nn.Linear(*pair), nn.ReLU())]
    return nn.Sequential(*between, nn.Linear(sizes[-1], outputs))


class SquashedPolicy(Model):
    """A Gaussian over velocities, squashed into [-1, 1] by tanh, its log-probability corrected for that.

    skrl's own Gaussian cuts actions at the limits instead and counts the density as if it had not.
    """

    def __init__(self, features: Box, action_space: Box, hidden: Sequence[int]) -> None:
        super().__init__(observation_space=features, action_space=action_space, device="cpu")
        self.net = layers(features.shape[0], hidden, 2 * ACTION_SIZE)

    def compute(self, inputs: Inputs, *, role: str = "") -> Output:
        """Mean and log standard deviation of the velocity before it is squashed."""
        features = inputs["observations"]
        mean, log_std = self.net(features).chunk(2, dim=1)
        log_std = MIN_LOG_STD + HALF_LOG_STD * (torch.tanh(log_std) + 1.0)
        return to_world_frame(mean, bearing_of(features)), {"log_std": log_std}

    @torch.inference_mode()
    def velocities(self, features: Float32Array, *, explore: bool) -> Float32Array:
        """(n, 3) the best ones known, or with `explore` drawn around them; the same numbers as `compute`'s.

        Of a few rows, NumPy's operators take a fraction of the time of torch's. But its tanh and exp round otherwise.
        """
        outputs = self.net(torch.from_numpy(features))
        x, y, z = (outputs.numpy()[:, axis : axis + 1] for axis in range(3))
        cosine, sine = features[:, :1], features[:, 1:2]
        velocities = np.concatenate([cosine * x - sine * y, cosine * y + sine * x, z], axis=1)
        if explore:
            log_std = MIN_LOG_STD + HALF_LOG_STD * (torch.tanh(outputs[:, ACTION_SIZE:]).numpy() + 1.0)
            velocities += torch.from_numpy(log_std).exp_().numpy() * torch.randn(velocities.shape).numpy()
        return torch.from_numpy(velocities).tanh_().numpy()

    def act(self, inputs: Inputs, *, role: str = "") -> Output:
        """Draw velocities; `log_prob` (n, 1) is theirs, `mean_actions` (n, 3) the best ones known."""
        mean, outputs = self.compute(inputs, role=role)
        gaussian = Normal(mean, outputs["log_std"].exp())
        drawn = gaussian.rsample()
        log_prob = gaussian.log_prob(drawn) - log_squashing(drawn)
        outputs |= {"log_prob": log_prob.sum(1, keepdim=True), "mean_actions": torch.tanh(mean)}
        return torch.tanh(drawn), outputs


def log_squashing(values: Tensor) -> Tensor:
    """The log of tanh's derivative, log(1 - tanh² x), in a form that does not lose it for large x."""
    return 2.0 * (math.log(2.0) - values - F.softplus(-2.0 * values))


class Critic(DeterministicMixin, Model):
    """The return to expect after taking a velocity."""

    def __init__(self, features: Box, action_space: Box, hidden: Sequence[int]) -> None:
        Model.__init__(self, observation_space=features, action_space=action_space, device="cpu")
        DeterministicMixin.__init__(self)
        self.net = layers(features.shape[0] + ACTION_SIZE, hidden, 1)

    def compute(self, inputs: Inputs, role: str = "") -> Output:  # pyright: ignore[reportIncompatibleMethodOverride]
        """(n, 1)."""
        features = inputs["observations"]
        action = to_drone_frame(inputs["taken_actions"], bearing_of(features))
        return self.net(torch.cat([features, action], dim=1)), {}


class GaussianPolicy(GaussianMixin, Model):
    """A Gaussian over velocities that the drone itself cuts at its limits, as PPO is usually run."""

    def __init__(self, features: Box, action_space: Box, hidden: Sequence[int]) -> None:
        Model.__init__(self, observation_space=features, action_space=action_space, device="cpu")
        GaussianMixin.__init__(self, min_log_std=MIN_LOG_STD, max_log_std=MAX_LOG_STD)
        self.net = layers(features.shape[0], hidden, ACTION_SIZE)
        self.log_std = nn.Parameter(torch.full((ACTION_SIZE,), math.log(0.6)))

    def compute(self, inputs: Inputs, role: str = "") -> Output:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Mean and log standard deviation of the velocity."""
        features = inputs["observations"]
        return to_world_frame(torch.tanh(self.net(features)), bearing_of(features)), {"log_std": self.log_std}


class Value(DeterministicMixin, Model):
    """The return to expect."""

    def __init__(self, features: Box, action_space: Box, hidden: Sequence[int]) -> None:
        Model.__init__(self, observation_space=features, action_space=action_space, device="cpu")
        DeterministicMixin.__init__(self)
        self.net = layers(features.shape[0], hidden, 1)

    def compute(self, inputs: Inputs, role: str = "") -> Output:  # pyright: ignore[reportIncompatibleMethodOverride]
        """(n, 1)."""
        return self.net(inputs["observations"]), {}
