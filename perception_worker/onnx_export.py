"""A TensorFlow pose network as ONNX, with its two outputs apart.

The graph may hold convolutions (depthwise ones too), biases, ReLU, max pooling and concatenation along channels: what
an OpenPose-type network of MobileNets is made of.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from perception_worker.network import HEATMAP_CHANNELS, PAF_CHANNELS
from perception_worker.tensorflow_graph import Node
from protocol.arrays import AnyArray
from protocol.errors import ArtifactDamaged

# Fixed, so that the same graph gives the same bytes with every version of onnx.
_OPSET = 13
_IR_VERSION = 8


def export(graph: Sequence[Node], name: str) -> onnx.ModelProto:
    """Translate a frozen graph that ends by concatenating heatmaps and part-affinity fields.

    The result takes `image` (n, 3, h, w), h and w multiples of 8, and gives `heatmaps` (n, 19, h/8, w/8) and `pafs`
    (n, 38, h/8, w/8).

    Raises:
        ArtifactDamaged: the graph holds an operation that isn't known here, or ends otherwise.
    """
    translation = _Translation(graph)
    outputs = translation.outputs()
    for node in graph:
        if node is not graph[-1]:
            translation.add(node)
    for output, produced in outputs.items():
        translation.nodes.append(helper.make_node("Identity", [produced], [output]))
    onnx_graph = helper.make_graph(
        translation.nodes,
        name,
        [_tensor_info("image", 3, "h", "w")],
        [_tensor_info("heatmaps", HEATMAP_CHANNELS, "h8", "w8"), _tensor_info("pafs", PAF_CHANNELS, "h8", "w8")],
        translation.constants,
    )
    model = helper.make_model(
        onnx_graph, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_IR_VERSION, producer_name="vantage"
    )
    onnx.checker.check_model(model, full_check=True)
    return model


class _Translation:
    """The nodes and constants of the ONNX graph so far."""

    def __init__(self, graph: Sequence[Node]) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self._last = graph[-1]
        self._values = {node.name: node.value for node in graph if node.value is not None}
        # ONNX's convolution has its bias inside, so a bias is taken over by the convolution that feeds it.
        self._bias_of = {node.inputs[0]: node for node in graph if node.operation == "BiasAdd"}

    def outputs(self) -> dict[str, str]:
        """Which tensors of the last concatenation are the heatmaps and the fields, told by their biases' lengths."""
        channels = {
            self._value(bias.inputs[1]).size: bias.name
            for bias in self._bias_of.values()
            if bias.name in self._last.inputs
        }
        if self._last.operation != "ConcatV2" or not {HEATMAP_CHANNELS, PAF_CHANNELS} <= channels.keys():
            raise ArtifactDamaged("the network's graph doesn't end with heatmaps and part-affinity fields")
        return {"heatmaps": channels[HEATMAP_CHANNELS], "pafs": channels[PAF_CHANNELS]}

    def add(self, node: Node) -> None:
        match node.operation:
            case "Const" | "Placeholder" | "BiasAdd":
                pass
            case "Conv2D" | "DepthwiseConv2dNative":
                self._add_convolution(node)
            case "Relu":
                self.nodes.append(helper.make_node("Relu", [node.inputs[0]], [node.name], name=node.name))
            case "MaxPool":
                pads = _pads(node, node.window)
                self._add_strided("MaxPool", node, [node.inputs[0]], node.name, kernel_shape=node.window, pads=pads)
            case "ConcatV2":
                self.nodes.append(
                    helper.make_node("Concat", list(node.inputs[:-1]), [node.name], name=node.name, axis=1)
                )
            case unknown:
                raise ArtifactDamaged(f"the network's graph holds the operation {unknown}, which can't be translated")

    def _add_convolution(self, node: Node) -> None:
        weights = self._value(node.inputs[1])
        window, groups = weights.shape[:2], 1
        if node.operation == "DepthwiseConv2dNative":
            groups = weights.shape[2]
            weights = weights.transpose(2, 3, 0, 1).reshape(-1, 1, *window)
        else:
            weights = weights.transpose(3, 2, 0, 1)
        inputs, output = [node.inputs[0], self._constant(node.inputs[1], weights)], node.name
        if bias := self._bias_of.get(node.name):
            inputs.append(self._constant(bias.inputs[1], self._value(bias.inputs[1])))
            output = bias.name
        self._add_strided("Conv", node, inputs, output, kernel_shape=window, pads=_pads(node, window), group=groups)

    def _add_strided(self, operation: str, node: Node, inputs: list[str], output: str, **attributes: Any) -> None:
        self.nodes.append(
            helper.make_node(operation, inputs, [output], name=node.name, strides=node.strides, **attributes)
        )

    def _constant(self, name: str, values: AnyArray) -> str:
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(values, np.float32), name))
        return name

    def _value(self, name: str) -> AnyArray:
        value = self._values.get(name)
        if value is None:
            raise ArtifactDamaged(f"the network's graph has no constant named {name}")
        return value


def _pads(node: Node, window: Sequence[int]) -> list[int]:
    """TensorFlow's SAME padding as explicit numbers: top, left, bottom, right.

    They hold for sizes that the strides divide, which is why the image's must be multiples of 8. The odd one of an
    uneven padding goes to the bottom and the right.
    """
    if node.padding != "SAME":
        raise ArtifactDamaged(f"{node.name} of the network's graph is padded {node.padding}, which isn't known here")
    total = [max(size - stride, 0) for size, stride in zip(window, node.strides, strict=True)]
    before = [size // 2 for size in total]
    return before + [size - first for size, first in zip(total, before, strict=True)]


def _tensor_info(name: str, channels: int, rows: str, columns: str) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", channels, rows, columns])
