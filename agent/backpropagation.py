"""Backpropagation through the plain networks of `networks.layers`, written out.

Autograd would do the same, but its graph costs about as much as the arithmetic of layers this small, and it computes
gradients that nobody asked for.

torch multiplies matrices by MKL, which leaves AVX-512 alone on processors that are not Intel's. Wide layers go to
oneDNN, which does not, by the operator that torch's compiler uses for them.
"""

import torch
import torch.nn.functional as F  # noqa: N812 (torch's own name for it)
from torch import Tensor, nn

_WIDE = 32
"""Numbers in and out of a layer from which on oneDNN is faster, although a call of it costs more."""

_HAS_ONEDNN = torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_linear_pointwise")


class Backpropagation:
    """One network's: `forward` keeps what `backward` needs, which may be asked once or not at all.

    >>> forward_and_back = Backpropagation(layers(93, (128, 128), 6))
    >>> outputs = forward_and_back.forward(features)
    >>> forward_and_back.backward(2 * (outputs - wanted))  # of the squared error; the parameters have a `grad` now

    Works without autograd: call it under `torch.no_grad`.
    """

    def __init__(self, net: nn.Sequential) -> None:
        self._linears = [layer for layer in net if isinstance(layer, nn.Linear)]
        self._inputs: list[Tensor] = []
        for parameter in net.parameters():
            parameter.grad = torch.zeros_like(parameter)

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs (n, …) of a batch of inputs (n, …)."""
        self._inputs = [inputs]
        for linear in self._linears[:-1]:
            self._inputs.append(_rectified(self._inputs[-1], linear))
        last = self._linears[-1]
        return F.linear(self._inputs[-1], last.weight, last.bias)

    def backward(self, gradient: Tensor, rows: slice = slice(None)) -> None:
        """Set the parameters' `grad`, from that of the outputs of the batch or of some of its rows."""
        for index in reversed(range(len(self._linears))):
            linear, inputs = self._linears[index], self._inputs[index][rows]
            torch.mm(gradient.t(), inputs, out=linear.weight.grad)
            torch.sum(gradient, 0, out=linear.bias.grad)
            if index > 0:
                gradient = _through(linear, gradient, inputs)

    def input_gradient(self, gradient: Tensor, columns: slice) -> Tensor:
        """(n, columns) the gradient of some of the inputs, from that of the outputs; the parameters' stays as it is."""
        for linear, inputs in zip(self._linears[:0:-1], self._inputs[:0:-1], strict=True):
            gradient = _through(linear, gradient, inputs)
        return torch.mm(gradient, self._linears[0].weight[:, columns])


def _rectified(inputs: Tensor, linear: nn.Linear) -> Tensor:
    """ReLU of a layer."""
    if _suits_onednn(linear):
        return torch.ops.mkldnn._linear_pointwise(inputs, linear.weight, linear.bias, "relu", [], "")
    return F.linear(inputs, linear.weight, linear.bias).relu_()


def _through(linear: nn.Linear, gradient: Tensor, inputs: Tensor) -> Tensor:
    """The gradient of what went into the ReLU before a layer: zero where that let nothing through."""
    if _suits_onednn(linear):
        before = torch.ops.mkldnn._linear_pointwise(gradient, linear.weight.t(), None, "none", [], "")
    else:
        before = torch.mm(gradient, linear.weight)
    return before.mul_(inputs.sign())


def _suits_onednn(linear: nn.Linear) -> bool:
    return _HAS_ONEDNN and min(linear.weight.shape) >= _WIDE and linear.weight.dtype == torch.float32
