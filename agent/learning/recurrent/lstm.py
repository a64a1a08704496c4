"""One layer of an LSTM over time, forwards and back, written out. Source: torch's `nn.LSTM`, whose numbers it gives.

Episodes end within a sequence, and what follows must not remember them. torch's own LSTM can't forget within a
sequence, so each episode would be a sequence of its own, packed with the others or filled up to the longest. See
docs/decisions/0309-our-own-recurrent-ppo.md.
"""

from typing import NamedTuple

import torch
from msgspec import Struct
from torch import Tensor

from agent.learning import onednn

_ONE = torch.ones(())
"""An operator takes half as long with it as with a number of Python's."""


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

    def unbound(self) -> list["LstmStep"]:
        """Step by step: views, made all at once since making one takes as long as a small operator."""
        states = (self.keep, self.hidden_before, self.cells_before, self.cells, self.squashed, self.outputs)
        unbound = zip(_parts(self.gates), *(tensor.unbind() for tensor in states), strict=True)
        return [LstmStep(*parts, *others) for parts, *others in unbound]


class LstmStep(NamedTuple):
    """Views of a step in an `LstmSequence`; `admit` to `expose` are the four quarters of `gates`: i, f, g and o."""

    gates: Tensor
    admit: Tensor
    forget: Tensor
    candidate: Tensor
    expose: Tensor
    keep: Tensor
    hidden_before: Tensor
    cells_before: Tensor
    cells: Tensor
    squashed: Tensor
    outputs: Tensor


def _parts(gates: Tensor) -> list[tuple[Tensor, ...]]:
    """Of each step: all gates (n, 4 h) of (t, n, 4 h), then the four quarters."""
    return list(zip(gates.unbind(), *(quarter.unbind() for quarter in gates.chunk(4, dim=2)), strict=True))


def run_layer(weights: LstmWeights, inputs: Tensor, keep: Tensor, state: Tensor) -> LstmSequence:
    """A layer's outputs for inputs (t, n, i), from its state (2, n, h) before the first step: hidden, then cells."""
    steps, count, size = len(inputs), inputs.shape[1], state.shape[2]
    gates = product(inputs.flatten(0, 1), weights.of_inputs, weights.bias).view(steps, count, 4 * size)
    hidden_before, cells_before, cells, squashed, outputs = (
        torch.empty(steps, count, size, dtype=inputs.dtype) for _ in range(5)
    )
    sequence = LstmSequence(inputs, keep, hidden_before, cells_before, gates, cells, squashed, outputs)
    of_hidden = weights.of_hidden
    if steps > 1 and _suits_onednn(hidden_before[0], of_hidden):
        of_hidden = onednn.packed(of_hidden, count)
    hidden, cell = state.unbind()
    for step in sequence.unbound():
        torch.mul(hidden, step.keep, out=step.hidden_before)
        torch.mul(cell, step.keep, out=step.cells_before)
        step.gates.add_(product(step.hidden_before, of_hidden))
        hidden, cell = _take(step)
    return sequence


def _take(step: LstmStep) -> tuple[Tensor, Tensor]:
    """Activate a step's gates; the hidden state and the cells after it."""
    # tanh x = 2 sigmoid 2x - 1, and torch's sigmoid takes a tenth of the time of its tanh.
    step.candidate.add_(step.candidate)
    step.gates.sigmoid_()
    step.candidate.add_(step.candidate).sub_(_ONE)
    torch.mul(step.forget, step.cells_before, out=step.cells).addcmul_(step.admit, step.candidate)
    squashed = torch.add(step.cells, step.cells, out=step.squashed).sigmoid_()
    squashed.add_(squashed).sub_(_ONE)
    return torch.mul(step.expose, step.squashed, out=step.outputs), step.cells


def gate_gradients(weights: LstmWeights, sequence: LstmSequence, gradient: Tensor) -> Tensor:
    """(t, n, 4 h) of a loss by the gates before activation, from that by the outputs (t, n, h).

    None goes back past an episode's start.
    """
    of_gates = torch.empty_like(sequence.gates)
    of_hidden = torch.zeros_like(gradient[0])
    of_cell = torch.zeros_like(of_hidden)
    transposed = weights.of_hidden.t()
    for step, of_output, own in zip(
        reversed(sequence.unbound()), reversed(gradient.unbind()), reversed(_parts(of_gates)), strict=True
    ):
        of_hidden += of_output
        _step_back(step, of_hidden, of_cell, own)
        of_cell *= step.keep
        of_hidden = product(own[0], transposed).mul_(step.keep)
    return of_gates


def _step_back(step: LstmStep, of_hidden: Tensor, of_cell: Tensor, of_gates: tuple[Tensor, ...]) -> None:
    """Set a step's gradients by its gates; `of_cell` becomes that by the cells before it."""
    _, of_admit, of_forget, of_candidate, of_expose = of_gates
    sigmoid_back, tanh_back = torch.ops.aten.sigmoid_backward.grad_input, torch.ops.aten.tanh_backward.grad_input
    of_cell += torch.ops.aten.tanh_backward.default(of_hidden * step.expose, step.squashed)
    sigmoid_back(of_hidden * step.squashed, step.expose, grad_input=of_expose)
    sigmoid_back(of_cell * step.candidate, step.admit, grad_input=of_admit)
    tanh_back(of_cell * step.admit, step.candidate, grad_input=of_candidate)
    sigmoid_back(of_cell * step.cells_before, step.forget, grad_input=of_forget)
    of_cell *= step.forget


def weight_gradients(sequence: LstmSequence, of_gates: Tensor) -> LstmWeights:
    """Of a layer's weights, from `gate_gradients`."""
    rows = of_gates.flatten(0, 1)
    return LstmWeights(
        of_inputs=weight_gradient(rows, sequence.inputs.flatten(0, 1)),
        of_hidden=weight_gradient(rows, sequence.hidden_before.flatten(0, 1)),
        bias=rows.sum(0),
    )


def input_gradient(weights: LstmWeights, of_gates: Tensor) -> Tensor:
    """(t, n, i) of a layer's inputs, from `gate_gradients`."""
    rows = product(of_gates.flatten(0, 1), weights.of_inputs.t())
    return rows.unflatten(0, of_gates.shape[:2])


def product(rows: Tensor, weight: Tensor, bias: Tensor | None = None) -> Tensor:
    """(n, o) `rows` (n, i) times `weight` (o, i) transposed, with a bias."""
    if _suits_onednn(rows, weight):
        return onednn.linear(rows, weight, bias)
    return torch.nn.functional.linear(rows, weight, bias)


def weight_gradient(gradient: Tensor, inputs: Tensor) -> Tensor:
    """(o, i) of the weight of a product, from the gradient (n, o) of its outputs and its inputs (n, i)."""
    if onednn.HAS_AVX512 and _suits_onednn(inputs, gradient.t()):
        # This way round, oneDNN copies the inputs, which are fewer.
        return onednn.linear(inputs.t(), gradient.t()).t()
    return torch.mm(gradient.t(), inputs)


def _suits_onednn(rows: Tensor, weight: Tensor) -> bool:
    return onednn.takes(weight) and min(len(rows), len(weight)) >= onednn.WIDE
