"""The lasting state of a skrl agent, taken out and put back whole.

skrl's own `save` leaves out the memory and its indices, and its `Memory.load` fills tensors that nothing reads.
"""

import copy
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from skrl.agents.torch import Agent
from skrl.memories.torch import Memory
from torch import Tensor, nn
from torch.optim import Optimizer

from protocol.errors import ArtifactDamaged


def optimizers_state(agent: Agent) -> dict[str, Any]:
    """The state of all optimisers, copied. That of the networks is `network_weights`."""
    return {name: copy.deepcopy(module.state_dict()) for name, module in _optimizers(agent).items()}


def restore_optimizers(agent: Agent, state: dict[str, Any]) -> None:
    """Put `optimizers_state` back."""
    for name, optimizer in _optimizers(agent).items():
        optimizer.load_state_dict(copy.deepcopy(state[name]))


def memory_tensors(memory: Memory) -> dict[str, Tensor]:
    """The memory's tensors, copied."""
    return {name: tensor.clone() for name, tensor in memory.tensors.items()}


def restore_memory_tensors(memory: Memory, tensors: dict[str, Tensor]) -> None:
    """Put `memory_tensors` back, in place, since the views that are sampled share the tensors' storage."""
    for name, tensor in tensors.items():
        memory.set_tensor_by_name(name, tensor)


def network_weights(agent: Agent) -> dict[str, NDArray[Any]]:
    """The parameters of all networks, copied; `critic_1.net.0.weight` and so on."""
    return {
        f"{name}.{parameter}": tensor.detach().cpu().numpy().copy()
        for name, network in _networks(agent).items()
        for parameter, tensor in network.state_dict().items()
    }


def load_network_weights(agent: Agent, weights: dict[str, NDArray[Any]]) -> None:
    """Put `network_weights` back, all or none.

    Raises:
        ArtifactDamaged: a parameter is missing, unknown, or has another shape.
    """
    shapes = {name: array.shape for name, array in weights.items()}
    expected = {name: array.shape for name, array in network_weights(agent).items()}
    for name in sorted(shapes | expected):
        if shapes.get(name) != expected.get(name):
            found, wanted = shapes.get(name, "none"), expected.get(name, "none")
            raise ArtifactDamaged(f"the weights don't fit the learner: {name} has the shape {found}, not {wanted}")
    for name, network in _networks(agent).items():
        prefix = f"{name}."
        own = {key: array for key, array in weights.items() if key.startswith(prefix)}
        network.load_state_dict({key.removeprefix(prefix): torch.tensor(array) for key, array in own.items()})


def tracked(agent: Agent) -> dict[str, float]:
    """The means of what the agent tracked since last asked; without a writer, skrl would keep all of it for ever."""
    means = {name: float(np.mean(values)) for name, values in agent.tracking_data.items()}
    agent.tracking_data.clear()
    return means


def _networks(agent: Agent) -> dict[str, nn.Module]:
    return {name: module for name, module in agent.checkpoint_modules.items() if isinstance(module, nn.Module)}


def _optimizers(agent: Agent) -> dict[str, Optimizer]:
    return {name: module for name, module in agent.checkpoint_modules.items() if isinstance(module, Optimizer)}
