"""The parameters of networks as arrays by name, as a checkpoint keeps them."""

from collections.abc import Mapping
from typing import Any

import torch
from numpy.typing import NDArray
from torch import nn

from protocol.errors import ArtifactDamaged


def weights_of(networks: Mapping[str, nn.Module]) -> dict[str, NDArray[Any]]:
    """The parameters of all networks, copied; `critic_1.net.0.weight` and so on."""
    return {
        f"{name}.{parameter}": tensor.detach().cpu().numpy().copy()
        for name, network in networks.items()
        for parameter, tensor in network.state_dict().items()
    }


def load_weights_into(networks: Mapping[str, nn.Module], weights: Mapping[str, NDArray[Any]]) -> None:
    """Put `weights_of` networks back, all or none.

    Raises:
        ArtifactDamaged: a parameter is missing, unknown, or has another shape.
    """
    shapes = {name: array.shape for name, array in weights.items()}
    expected = {name: array.shape for name, array in weights_of(networks).items()}
    for name in sorted(shapes | expected):
        if shapes.get(name) != expected.get(name):
            found, wanted = shapes.get(name, "none"), expected.get(name, "none")
            raise ArtifactDamaged(f"the weights don't fit the learner: {name} has the shape {found}, not {wanted}")
    for name, network in networks.items():
        prefix = f"{name}."
        own = {key: array for key, array in weights.items() if key.startswith(prefix)}
        network.load_state_dict({key.removeprefix(prefix): torch.tensor(array) for key, array in own.items()})
