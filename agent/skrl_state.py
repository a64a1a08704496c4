"""What there is to a skrl agent that lasts, taken out and put back whole.

skrl's own `save` leaves out the memory and its indices, and its `Memory.load` fills tensors that nothing reads.
"""

import copy
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from skrl.agents.torch import Agent
from skrl.memories.torch import Memory
from torch import nn

from protocol.errors import ArtifactDamaged


def modules_state(agent: Agent) -> dict[str, Any]:
    """The state of all networks and optimisers, copied."""
    return {name: copy.deepcopy(module.state_dict()) for name, module in agent.checkpoint_modules.items()}


def restore_modules(agent: Agent, state: dict[str, Any]) -> None:
    """Put `modules_state` back."""
    for name, module in agent.checkpoint_modules.items():
        module.load_state_dict(copy.deepcopy(state[name]))


def memory_state(memory: Memory) -> dict[str, Any]:
    """The transitions in memory, copied, and where the next one goes."""
    return {
        "tensors": {name: tensor.clone() for name, tensor in memory.tensors.items()},
        "memory_index": memory.memory_index,
        "env_index": memory.env_index,
        "filled": memory.filled,
    }


def restore_memory(memory: Memory, state: dict[str, Any]) -> None:
    """Put `memory_state` back, in place, since the views that are sampled share the tensors' storage."""
    for name, tensor in state["tensors"].items():
        memory.set_tensor_by_name(name, tensor)
    memory.memory_index, memory.env_index = state["memory_index"], state["env_index"]
    memory.filled = state["filled"]


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
