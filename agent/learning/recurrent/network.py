"""The network of the actor and that of the critic: an LSTM, a tanh layer, a linear head (thesis, section 4.3.6).

Its parameters are those of torch's modules. It computes with them by `lstm`, without autograd.
"""

import math
from typing import cast

import torch
from msgspec import Struct
from torch import Tensor, nn

from agent.learning.recurrent.encoding import INPUT_SIZE, encoded
from agent.learning.recurrent.lstm import (
    LstmSequence,
    LstmWeights,
    gate_gradients,
    input_gradient,
    product,
    run_layer,
    weight_gradient,
    weight_gradients,
)
from protocol.learner_config import RecurrentPpoConfig


class Sequence(Struct, frozen=True, eq=False):
    """What a network computed for a sequence, step by step.

    Attributes:
        layers: of the LSTM, the first one first.
        features: (t, n, f) after the tanh layer.
        outputs: (t, n, o).
    """

    layers: tuple[LstmSequence, ...]
    features: Tensor
    outputs: Tensor

    @property
    def last_state(self) -> Tensor:
        """(2, l, n, h) after the last step."""
        return _state([layer.outputs[-1] for layer in self.layers], [layer.cells[-1] for layer in self.layers])

    def states_after(self, steps: Tensor, drones: Tensor) -> Tensor:
        """(2, l, k, h) after k steps, each of its drone."""
        hidden = [layer.outputs[steps, drones] for layer in self.layers]
        return _state(hidden, [layer.cells[steps, drones] for layer in self.layers])


class RecurrentNetwork(nn.Module):
    """Outputs for sequences of observations, and the gradients of its parameters.

    A state is (2, l, n, h): hidden states and cells of each layer and drone. Works without autograd: call it under
    `torch.no_grad` or `torch.inference_mode`.
    """

    def __init__(self, config: RecurrentPpoConfig, outputs: int, *, head_gain: float) -> None:
        super().__init__()
        self.lstm = nn.LSTM(INPUT_SIZE, config.lstm_hidden_size, config.n_lstm_layers)
        self.hidden = nn.Linear(config.lstm_hidden_size, config.hidden_size)
        self.head = nn.Linear(config.hidden_size, outputs)
        self._remembers = config.memory
        _initialise(self, head_gain)
        for parameter in self.parameters():
            parameter.grad = torch.zeros_like(parameter)

    def start(self, count: int) -> Tensor:
        """(2, l, n, h) the state that an episode of each of `count` drones starts with."""
        return torch.zeros(2, self.lstm.num_layers, count, self.lstm.hidden_size, dtype=self.head.weight.dtype)

    def run(self, observations: Tensor, starts: Tensor, state: Tensor) -> Sequence:
        """The outputs for observations (t, n, 20) from a state before the first; it is forgotten at `starts` (t, n).

        Without memory (`RecurrentPpoConfig.memory`), it is forgotten before each step.
        """
        inputs = encoded(observations)
        remembered = ~starts if self._remembers else torch.zeros_like(starts)
        keep = remembered.to(inputs.dtype).unsqueeze(2)
        layers: list[LstmSequence] = []
        for number, own in enumerate(state.unbind(1)):
            layers.append(run_layer(self._layer(number), inputs, keep, own))
            inputs = layers[-1].outputs
        features = product(inputs.flatten(0, 1), self.hidden.weight, self.hidden.bias).tanh_()
        outputs = product(features, self.head.weight, self.head.bias)
        shape = starts.shape
        return Sequence(tuple(layers), features.unflatten(0, shape), outputs.unflatten(0, shape))

    def backpropagate(self, sequence: Sequence, gradient: Tensor) -> None:
        """Set the parameters' `grad`, from that of the outputs (t, n, o) of a sequence."""
        features, rows = sequence.features.flatten(0, 1), gradient.flatten(0, 1)
        _set_gradients(self.head, rows, features)
        rows = torch.ops.aten.tanh_backward(product(rows, self.head.weight.t()), features)
        _set_gradients(self.hidden, rows, sequence.layers[-1].outputs.flatten(0, 1))
        gradient = product(rows, self.hidden.weight.t()).view_as(sequence.layers[-1].outputs)
        for number, layer in reversed(list(enumerate(sequence.layers))):
            weights = self._layer(number)
            of_gates = gate_gradients(weights, layer, gradient)
            self._set_layer_gradients(number, weight_gradients(layer, of_gates))
            if number > 0:
                gradient = input_gradient(weights, of_gates)

    def _layer(self, number: int) -> LstmWeights:
        return LstmWeights(
            of_inputs=self._parameter("weight_ih", number),
            of_hidden=self._parameter("weight_hh", number),
            bias=self._parameter("bias_ih", number) + self._parameter("bias_hh", number),
        )

    def _set_layer_gradients(self, number: int, gradients: LstmWeights) -> None:
        _grad(self._parameter("weight_ih", number)).copy_(gradients.of_inputs)
        _grad(self._parameter("weight_hh", number)).copy_(gradients.of_hidden)
        _grad(self._parameter("bias_ih", number)).copy_(gradients.bias)
        _grad(self._parameter("bias_hh", number)).copy_(gradients.bias)

    def _parameter(self, name: str, number: int) -> nn.Parameter:
        return getattr(self.lstm, f"{name}_l{number}")


def _state(hidden: list[Tensor], cells: list[Tensor]) -> Tensor:
    return torch.stack([torch.stack(hidden), torch.stack(cells)])


def _initialise(network: RecurrentNetwork, head_gain: float) -> None:
    """Orthogonal weights and no biases, as is usual for PPO; a small head makes the first policy all but even."""
    for name, parameter in network.named_parameters():
        if parameter.dim() == 1:
            nn.init.zeros_(parameter)
        else:
            gains = {"hidden.weight": math.sqrt(2.0), "head.weight": head_gain}
            nn.init.orthogonal_(parameter, gains.get(name, 1.0))


def _set_gradients(linear: nn.Linear, gradient: Tensor, inputs: Tensor) -> None:
    _grad(linear.weight).copy_(weight_gradient(gradient, inputs))
    torch.sum(gradient, 0, out=_grad(linear.bias))


def _grad(parameter: Tensor) -> Tensor:
    return cast(Tensor, parameter.grad)
