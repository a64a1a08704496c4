"""A pose network on PyTorch, operation by operation, where ONNX Runtime has no GPU: for comparison only.

It knows what the default network is made of: convolutions, ReLU, max pooling and concatenation.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import onnx
import torch
import torch.nn.functional as F  # noqa: N812 (torch's own name for it)
from onnx import numpy_helper
from torch import Tensor

from perception_worker.networks.engine import Outputs, shapes_of
from protocol.arrays import Float32Array
from protocol.errors import Unavailable

Attributes: TypeAlias = Mapping[str, Any]


class TorchEngine:
    """A network in float32 on a device of torch's.

    Raises:
        Unavailable: the network has an operation that isn't known here.
    """

    def __init__(self, file: Path, *, input_size: tuple[int, int], device: str) -> None:
        graph = onnx.load(file).graph
        # TF32 would round the inputs of every product to 10 bits; trying algorithms out would choose another each time.
        torch.backends.cudnn.allow_tf32 = torch.backends.cuda.matmul.allow_tf32 = False
        torch.backends.cudnn.deterministic, torch.backends.cudnn.benchmark = True, False
        self.input_size = input_size
        self._device = torch.device(device)
        self._constants = {
            one.name: torch.from_numpy(numpy_helper.to_array(one).copy()).to(self._device) for one in graph.initializer
        }
        self._steps = [_step_of(node) for node in graph.node]
        self._input = graph.input[0].name
        self._names = [output.name for output in graph.output]
        self.outputs = shapes_of(self.run(np.zeros((3, *input_size), np.float32)))

    @property
    def device(self) -> str:
        """The device, by torch's name."""
        return torch.cuda.get_device_name(self._device) if self._device.type == "cuda" else "CPU"

    def run(self, image: Float32Array) -> Outputs:
        """The network's outputs for an image (3, rows, columns), by name and without the batch's dimension."""
        with torch.inference_mode():
            values = dict(self._constants)
            values[self._input] = torch.from_numpy(image[None]).to(self._device)
            for operation, inputs, output, attributes in self._steps:
                values[output] = operation([values[name] for name in inputs], attributes)
            return {name: values[name][0].cpu().numpy() for name in self._names}


def _step_of(node: onnx.NodeProto) -> tuple["_Operation", list[str], str, Attributes]:
    operation = _OPERATIONS.get(node.op_type)
    if operation is None:
        raise Unavailable(f"the network has the operation {node.op_type}, which PyTorch isn't asked for here")
    attributes = {one.name: onnx.helper.get_attribute_value(one) for one in node.attribute}
    return operation, list(node.input), node.output[0], attributes


def _padded(image: Tensor, attributes: Attributes, value: float) -> Tensor:
    top, left, bottom, right = attributes.get("pads", (0, 0, 0, 0))
    return F.pad(image, (left, right, top, bottom), value=value)


def _convolved(inputs: list[Tensor], attributes: Attributes) -> Tensor:
    image, weights, *bias = inputs
    return F.conv2d(
        _padded(image, attributes, 0.0),
        weights,
        bias[0] if bias else None,
        stride=tuple(attributes.get("strides", (1, 1))),
        groups=attributes.get("group", 1),
    )


def _pooled(inputs: list[Tensor], attributes: Attributes) -> Tensor:
    image = _padded(inputs[0], attributes, -torch.inf)
    return F.max_pool2d(image, tuple(attributes["kernel_shape"]), stride=tuple(attributes["strides"]))


_Operation: TypeAlias = Callable[[list[Tensor], Attributes], Tensor]

_OPERATIONS: dict[str, _Operation] = {
    "Conv": _convolved,
    "MaxPool": _pooled,
    "Relu": lambda inputs, _: F.relu(inputs[0]),
    "Concat": lambda inputs, attributes: torch.cat(inputs, dim=attributes["axis"]),
    "Identity": lambda inputs, _: inputs[0],
}
