"""The lasting state of a skrl agent, taken out and put back whole.

skrl's own `save` leaves out the memory and its indices, and its `Memory.load` fills tensors that nothing reads.
"""

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skrl.agents.torch import Agent
from skrl.memories.torch import Memory
from torch import Tensor, nn
from torch.optim import Optimizer

from agent.learning.weights import load_weights_into, weights_of


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
    """The parameters of all networks, copied."""
    return weights_of(_networks(agent))


def load_network_weights(agent: Agent, weights: dict[str, NDArray[Any]]) -> None:
    """Put `network_weights` back, all or none.

    Raises:
        ArtifactDamaged: a parameter is missing, unknown, or has another shape.
    """
    load_weights_into(_networks(agent), weights)


def tracked(agent: Agent) -> dict[str, float]:
    """The means of what the agent tracked since last asked; without a writer, skrl would keep all of it for ever."""
    means = {name: float(np.mean(values)) for name, values in agent.tracking_data.items()}
    agent.tracking_data.clear()
    return means


def _networks(agent: Agent) -> dict[str, nn.Module]:
    return {name: module for name, module in agent.checkpoint_modules.items() if isinstance(module, nn.Module)}


def _optimizers(agent: Agent) -> dict[str, Optimizer]:
    return {name: module for name, module in agent.checkpoint_modules.items() if isinstance(module, Optimizer)}
