"""Backpropagation through the plain networks of `networks.layers`, written out.

Autograd would do the same, but its graph costs about as much as the arithmetic of layers this small, and it computes
gradients that are not needed. Wide layers go to oneDNN.
"""

import torch
import torch.nn.functional as F  # noqa: N812 (torch's own name for it)
from msgspec import Struct
from torch import Tensor, nn

from agent.learning import onednn


class _Layer(Struct, frozen=True, eq=False):
    """A linear layer's tensors, looked up once: a module is slow to find a parameter.

    Attributes:
        weight, bias: without autograd, in the parameters' storage.
        transposed: a view of `weight`.
        weight_gradient, bias_gradient: the parameters' `grad`.
        suits_onednn: whether oneDNN is faster than torch's own choice.
    """

    weight: Tensor
    bias: Tensor
    transposed: Tensor
    weight_gradient: Tensor
    bias_gradient: Tensor
    suits_onednn: bool


class Backpropagation:
    """One network's: `forward` keeps what `backward` needs, which may be asked once or not at all.

    >>> import torch
    >>> from agent.learning.backpropagation import Backpropagation
    >>> from agent.learning.networks import layers
    >>> net, features, wanted = layers(93, (128, 128), 6), torch.zeros(256, 93), torch.ones(256, 6)
    >>> forward_and_back = Backpropagation(net)
    >>> with torch.no_grad():
    ...     outputs = forward_and_back.forward(features)
    ...     forward_and_back.backward(2 * (outputs - wanted))  # of the squared error
    >>> net[0].weight.grad.shape
    torch.Size([128, 93])

    Works without autograd: call it under `torch.no_grad` or `torch.inference_mode`.
    """

    def __init__(self, net: nn.Sequential) -> None:
        self._layers = [_layer_of(module) for module in net if isinstance(module, nn.Linear)]
        self._inputs: list[Tensor] = []

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs (n, …) of a batch of inputs (n, …)."""
        self._inputs = [inputs]
        for layer in self._layers[:-1]:
            inputs = _rectified(inputs, layer)
            self._inputs.append(inputs)
        return F.linear(inputs, self._layers[-1].weight, self._layers[-1].bias)

    def backward(self, gradient: Tensor, rows: slice | None = None) -> None:
        """Set the parameters' `grad`, from that of the outputs of the batch or of some of its rows."""
        for index in reversed(range(len(self._layers))):
            layer, inputs = self._layers[index], self._inputs[index]
            if rows is not None:
                inputs = inputs[rows]
            _set_weight_gradient(layer, gradient, inputs)
            torch.sum(gradient, 0, out=layer.bias_gradient)
            if index > 0:
                gradient = _through(layer, gradient, inputs)

    def input_gradient(self, gradient: Tensor, columns: slice) -> Tensor:
        """(n, columns) the gradient of some of the inputs, from that of the outputs; the parameters' is kept."""
        for layer, inputs in zip(self._layers[:0:-1], self._inputs[:0:-1], strict=True):
            gradient = _through(layer, gradient, inputs)
        # The same numbers as `gradient @ weight`, but MKL takes twice as long for few columns as for few rows.
        return torch.mm(self._layers[0].transposed[columns], gradient.t()).t()


def _layer_of(linear: nn.Linear) -> _Layer:
    weight, bias = linear.weight.detach(), linear.bias.detach()
    linear.weight.grad, linear.bias.grad = torch.zeros_like(weight), torch.zeros_like(bias)
    suits_onednn = onednn.takes(weight) and min(weight.shape) >= onednn.WIDE
    return _Layer(weight, bias, weight.t(), linear.weight.grad, linear.bias.grad, suits_onednn)


def _rectified(inputs: Tensor, layer: _Layer) -> Tensor:
    """ReLU of a layer."""
    if layer.suits_onednn:
        return onednn.linear(inputs, layer.weight, layer.bias, "relu")
    return F.linear(inputs, layer.weight, layer.bias).relu_()


def _set_weight_gradient(layer: _Layer, gradient: Tensor, inputs: Tensor) -> None:
    if layer.suits_onednn and onednn.HAS_AVX512:
        layer.weight_gradient.copy_(onednn.linear(gradient.t(), inputs.t()))
    else:
        torch.mm(gradient.t(), inputs, out=layer.weight_gradient)


def _through(layer: _Layer, gradient: Tensor, inputs: Tensor) -> Tensor:
    """The gradient of what went into the ReLU before a layer: zero where that let nothing through."""
    before = onednn.linear(gradient, layer.transposed) if layer.suits_onednn else torch.mm(gradient, layer.weight)
    return torch.ops.aten.threshold_backward.grad_input(before, inputs, 0, grad_input=before)
