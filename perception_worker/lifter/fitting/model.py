"""The lifter's network in torch, with the names and shapes of weights that `LifterNetwork` has; and its loss."""

import torch
import torch.nn.functional as F  # noqa: N812 (torch's own name for it)
from torch import Tensor, nn

from perception_worker.lifter.network import NORM_EPSILON, Shape

_DROPOUT = 0.05


class LifterModel(nn.Module):
    """`perception_worker.lifter.network.LifterNetwork` with gradients."""

    def __init__(self, shape: Shape, dropout: float = _DROPOUT) -> None:
        super().__init__()
        self._shape, self._dropout = shape, dropout
        self._weights = nn.ParameterDict(
            {_key(name): nn.Parameter(_initial(name, size)) for name, size in shape.parameters().items()}
        )

    def forward(self, tokens: Tensor) -> Tensor:
        """(n, 18, 5) for tokens (n, 18, TOKEN_SIZE)."""
        weight = self._weight
        state = tokens @ weight("input") + weight("joints")
        for layer in range(self._shape.layers):
            state = state + self._dropped(self._attended(_normed(state), f"{layer}.attention"))
            hidden = F.relu(_normed(state) @ weight(f"{layer}.hidden") + weight(f"{layer}.hidden_bias"))
            state = state + self._dropped(hidden @ weight(f"{layer}.output") + weight(f"{layer}.output_bias"))
        return _normed(state) @ weight("output") + weight("output_bias")

    def weights(self) -> dict[str, Tensor]:
        """The parameters by their names."""
        return {name: self._weight(name) for name in self._shape.parameters()}

    def _weight(self, name: str) -> Tensor:
        return self._weights[_key(name)]

    def _attended(self, state: Tensor, name: str) -> Tensor:
        asked = state @ self._weight(f"{name}.input") + self._weight(f"{name}.input_bias")
        query, key, value = asked.unflatten(2, (3, self._shape.heads, -1)).permute(2, 0, 3, 1, 4)
        told = F.scaled_dot_product_attention(query, key, value)
        merged = told.transpose(1, 2).flatten(2)
        return merged @ self._weight(f"{name}.output") + self._weight(f"{name}.output_bias")

    def _dropped(self, state: Tensor) -> Tensor:
        return F.dropout(state, self._dropout, self.training)


def lifted(outputs: Tensor, rays: Tensor, depth: Tensor) -> Tensor:
    """(n, 18, 3) points in the cameras' frames; see `perception_worker.lifter.tokens.points_of`."""
    along = depth[:, None] + outputs[:, :, 2]
    return torch.cat([rays * along[:, :, None] + outputs[:, :, :2], along[:, :, None]], dim=2)


def loss(outputs: Tensor, points: Tensor, truth: Tensor, rays: Tensor) -> Tensor:
    """Mean distance of the points, and the likelihood of the scales at these distances.

    The scales are of a Laplace distribution along each joint's ray, and of one in the plane across it. They learn from
    detached errors, so the points learn independently of the scales.
    """
    error = points - truth
    along = F.normalize(F.pad(rays, (0, 1), value=1.0), dim=2)
    ahead = (error * along).sum(2)
    across = (error - ahead[:, :, None] * along).norm(dim=2)
    log_across, log_ahead = outputs[:, :, 3], outputs[:, :, 4]
    likelihood = 2 * log_across + across.detach() * (-log_across).exp()
    likelihood = likelihood + log_ahead + ahead.detach().abs() * (-log_ahead).exp()
    return (error.square().sum(2) + 1e-8).sqrt().mean() + LIKELIHOOD_SHARE * likelihood.mean()


LIKELIHOOD_SHARE = 0.02
"""The weight of the likelihood beside the distance in metres: positions matter most."""


def _key(name: str) -> str:
    return name.replace(".", "_")


def _initial(name: str, size: tuple[int, ...]) -> Tensor:
    if name == "joints":
        return torch.randn(size) * 0.1
    if len(size) == 1:
        return torch.zeros(size)
    if name == "output":
        return torch.zeros(size)
    return nn.init.xavier_uniform_(torch.empty(size))


def _normed(state: Tensor) -> Tensor:
    return F.layer_norm(state, state.shape[-1:], eps=NORM_EPSILON)
