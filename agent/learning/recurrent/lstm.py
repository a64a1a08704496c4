"""One layer of an LSTM over time, forwards and back, written out. Source: torch's `nn.LSTM`, whose numbers it gives.

Episodes end within a sequence, and what follows must not remember them. torch's own LSTM can't forget within a
sequence, so each episode would be a sequence of its own, of its own length; that takes several times as long.
"""

import torch
from msgspec import Struct
from torch import Tensor

from agent.learning import onednn


class LstmWeights(Struct, frozen=True, eq=False):
    """A layer's, as `nn.LSTM` has them: rows of the gates i, f, g and o, one after the other.

    Attributes:
        of_inputs: (4 h, i).
        of_hidden: (4 h, h).
        bias: (4 h,), the sum of the two that `nn.LSTM` has.
    """

    of_inputs: Tensor
    of_hidden: Tensor
    bias: Tensor


class LstmSequence(Struct, frozen=True, eq=False):
    """What a layer computed, step by step.

    Attributes:
        inputs: (t, n, i).
        keep: (t, n, 1) 0 where an episode starts, else 1.
        hidden_before, cells_before: (t, n, h) the state that a step begins with; 0 where an episode starts.
        gates: (t, n, 4 h) after their activation.
        cells: (t, n, h).
        squashed: (t, n, h) tanh of `cells`.
        outputs: (t, n, h) the hidden state after a step.
    """

    inputs: Tensor
    keep: Tensor
    hidden_before: Tensor
    cells_before: Tensor
    gates: Tensor
    cells: Tensor
    squashed: Tensor
    outputs: Tensor


class LstmGradients(Struct, frozen=True, eq=False):
    """Of a layer's weights, and of its inputs (t, n, i)."""

    of_inputs: Tensor
    of_hidden: Tensor
    bias: Tensor
    inputs: Tensor


def run_layer(weights: LstmWeights, inputs: Tensor, keep: Tensor, state: Tensor) -> LstmSequence:
    """A layer's outputs for inputs (t, n, i), from its state (2, n, h) before the first step: hidden, then cells."""
    steps, count, size = len(inputs), inputs.shape[1], state.shape[2]
    gates = product(inputs.flatten(0, 1), weights.of_inputs, weights.bias).view(steps, count, 4 * size)
    hidden_before, cells_before, cells, squashed, outputs = (
        torch.empty(steps, count, size, dtype=inputs.dtype) for _ in range(5)
    )
    sequence = LstmSequence(inputs, keep, hidden_before, cells_before, gates, cells, squashed, outputs)
    hidden, cell = state.unbind()
    for step in range(steps):
        torch.mul(hidden, keep[step], out=hidden_before[step])
        torch.mul(cell, keep[step], out=cells_before[step])
        gates[step] += product(hidden_before[step], weights.of_hidden)
        hidden, cell = _take_step(sequence, step)
    return sequence


def _take_step(sequence: LstmSequence, step: int) -> tuple[Tensor, Tensor]:
    """Activate a step's gates; the hidden state and cells after it."""
    gates = sequence.gates[step]
    size = gates.shape[1] // 4
    gates[:, : 2 * size].sigmoid_()
    gates[:, 2 * size : 3 * size].tanh_()
    gates[:, 3 * size :].sigmoid_()
    admit, forget, candidate, expose = gates.chunk(4, dim=1)
    cell = torch.mul(forget, sequence.cells_before[step], out=sequence.cells[step]).addcmul_(admit, candidate)
    squashed = torch.tanh(cell, out=sequence.squashed[step])
    return torch.mul(expose, squashed, out=sequence.outputs[step]), cell


def backpropagate(weights: LstmWeights, sequence: LstmSequence, gradient: Tensor) -> LstmGradients:
    """The gradients of a loss, from that by the layer's outputs (t, n, h); none goes back past an episode's start."""
    of_gates = torch.empty_like(sequence.gates)
    of_hidden = torch.zeros_like(sequence.outputs[0])
    of_cell = torch.zeros_like(of_hidden)
    for step in reversed(range(len(gradient))):
        of_hidden += gradient[step]
        _step_back(sequence, step, of_hidden, of_cell, of_gates[step])
        of_cell *= sequence.keep[step]
        of_hidden = product(of_gates[step], weights.of_hidden.t()).mul_(sequence.keep[step])
    rows = of_gates.flatten(0, 1)
    return LstmGradients(
        of_inputs=weight_gradient(rows, sequence.inputs.flatten(0, 1)),
        of_hidden=weight_gradient(rows, sequence.hidden_before.flatten(0, 1)),
        bias=rows.sum(0),
        inputs=product(rows, weights.of_inputs.t()).view_as(sequence.inputs),
    )


def _step_back(sequence: LstmSequence, step: int, of_hidden: Tensor, of_cell: Tensor, of_gates: Tensor) -> None:
    """Set a step's `of_gates` (n, 4 h), before activation; `of_cell` becomes the gradient by the cells before it."""
    admit, forget, candidate, expose = sequence.gates[step].chunk(4, dim=1)
    of_admit, of_forget, of_candidate, of_expose = of_gates.chunk(4, dim=1)
    squashed = sequence.squashed[step]
    sigmoid_back, tanh_back = torch.ops.aten.sigmoid_backward.grad_input, torch.ops.aten.tanh_backward.grad_input
    of_cell += torch.ops.aten.tanh_backward(of_hidden * expose, squashed)
    sigmoid_back(of_hidden * squashed, expose, grad_input=of_expose)
    sigmoid_back(of_cell * candidate, admit, grad_input=of_admit)
    tanh_back(of_cell * admit, candidate, grad_input=of_candidate)
    sigmoid_back(of_cell * sequence.cells_before[step], forget, grad_input=of_forget)
    of_cell *= forget


def product(rows: Tensor, weight: Tensor, bias: Tensor | None = None) -> Tensor:
    """(n, o) `rows` (n, i) times `weight` (o, i) transposed, with a bias."""
    if onednn.suits(weight):
        return onednn.linear(rows, weight, bias)
    return torch.nn.functional.linear(rows, weight, bias)


def weight_gradient(gradient: Tensor, inputs: Tensor) -> Tensor:
    """(o, i) of the weight of a product, from the gradient (n, o) of its outputs and its inputs (n, i)."""
    if onednn.HAS_AVX512 and onednn.suits(gradient) and min(gradient.shape[1], inputs.shape[1]) >= onednn.WIDE:
        return onednn.linear(gradient.t(), inputs.t())
    return torch.mm(gradient.t(), inputs)
