"""A TensorFlow pose network as ONNX, whole or a part of it.

The graph may hold convolutions (depthwise ones too), biases, ReLU, sigmoids, max pooling, padding, sums, doubling in
size and concatenation along channels: what a pose network of MobileNets is made of.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from perception_worker.networks.network import HEATMAP_CHANNELS, PAF_CHANNELS
from perception_worker.networks.tensorflow_graph import Node
from protocol.arrays import AnyArray
from protocol.errors import ArtifactDamaged

# Fixed, so that the same graph gives the same bytes with every version of onnx.
_OPSET = 13
_IR_VERSION = 8

IMAGE = "image"


def export(graph: Sequence[Node], name: str, ends: Mapping[str, str] | None = None) -> onnx.ModelProto:
    """Translate a frozen graph that ends by concatenating heatmaps and part-affinity fields.

    The result takes `image` (n, 3, h, w), h and w multiples of 8, and gives `heatmaps` (n, 19, h/8, w/8) and `pafs`
    (n, 38, h/8, w/8).

    Args:
        graph: its nodes, each after the nodes that feed it.
        name: of the network.
        ends: the nodes that give `heatmaps` and `pafs`, where not all of the graph is wanted.

    Raises:
        ArtifactDamaged: the graph holds an operation that isn't known here, ends otherwise, or has no such node.
    """
    translation = _Translation(graph)
    outputs = translation.outputs() if ends is None else ends
    for node in graph[:-1] if ends is None else _between(graph, "", list(ends.values())):
        translation.add(node)
    results = [_tensor_info("heatmaps", HEATMAP_CHANNELS, "h8", "w8"), _tensor_info("pafs", PAF_CHANNELS, "h8", "w8")]
    return translation.model(name, outputs, _tensor_info(IMAGE, 3, "h", "w"), results)


def export_part(
    graph: Sequence[Node], name: str, *, begin: str, ends: Mapping[str, tuple[str, int]], size: tuple[int, int]
) -> onnx.ModelProto:
    """Translate what lies between a node of a graph and some others.

    The result takes `image` (1, 3, rows, columns), which is what `begin` gives in the graph.

    Args:
        graph: its nodes, each after the nodes that feed it.
        name: of the network.
        begin: the node whose value the image takes the place of.
        ends: for each output, which node gives it and how many channels it has.
        size: the image's rows and columns.

    Raises:
        ArtifactDamaged: there is no such node, or an operation between them isn't known here.
    """
    translation = _Translation(graph, begin)
    for node in _between(graph, begin, [node for node, _ in ends.values()]):
        translation.add(node)
    results = [_tensor_info(output, channels, None, None, batch=1) for output, (_, channels) in ends.items()]
    outputs = {output: node for output, (node, _) in ends.items()}
    return translation.model(name, outputs, _tensor_info(IMAGE, 3, *size, batch=1), results)


def _between(graph: Sequence[Node], begin: str, ends: Sequence[str]) -> list[Node]:
    """The nodes that the ends need, without `begin` and all that only it needs, in the graph's order."""
    by_name = {node.name: node for node in graph}
    needed: set[str] = set()
    waiting = list(ends)
    while waiting:
        name = waiting.pop()
        if name == begin or name in needed:
            continue
        if name not in by_name:
            raise ArtifactDamaged(f"the network's graph has no node named {name}")
        needed.add(name)
        waiting += by_name[name].inputs
    return [node for node in graph if node.name in needed]


def _checked(onnx_graph: onnx.GraphProto) -> onnx.ModelProto:
    model = helper.make_model(
        onnx_graph, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_IR_VERSION, producer_name="vantage"
    )
    onnx.checker.check_model(model, full_check=True)
    return model


class _Translation:
    """The nodes and constants of the ONNX graph so far."""

    def __init__(self, graph: Sequence[Node], begin: str | None = None) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self._last = graph[-1]
        self._begin = begin
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

    def model(
        self, name: str, outputs: Mapping[str, str], image: onnx.ValueInfoProto, results: list[onnx.ValueInfoProto]
    ) -> onnx.ModelProto:
        """All of it, with the nodes that give the outputs."""
        for output, produced in outputs.items():
            self.nodes.append(helper.make_node("Identity", [produced], [output]))
        return _checked(helper.make_graph(self.nodes, name, [image], results, self.constants))

    def add(self, node: Node) -> None:
        inputs = [IMAGE if name == self._begin else name for name in node.inputs]
        node = replace(node, inputs=tuple(inputs))
        match node.operation:
            case "Const" | "Placeholder" | "BiasAdd":
                pass
            case "Conv2D" | "DepthwiseConv2dNative":
                self._add_convolution(node)
            case "Relu" | "Sigmoid":
                self.nodes.append(helper.make_node(node.operation, inputs, [node.name], name=node.name))
            case "AddV2":
                self.nodes.append(helper.make_node("Add", inputs, [node.name], name=node.name))
            case "Relu6":
                self._add_with("Clip", node, inputs[0], np.float32(0), np.float32(6))
            case "Pad":
                pads = self._value(inputs[1])[[0, 3, 1, 2]]
                self._add_with("Pad", node, inputs[0], pads.T.astype(np.int64).ravel())
            case "ResizeBilinear":
                # Every pose network known here doubles rows and columns; where one did not, its sums would not fit.
                scales = np.array([1, 1, 2, 2], np.float32)
                self._add_with("Resize", node, inputs[0], None, scales, mode="linear")
            case "MaxPool":
                pads = _pads(node, node.window)
                self._add_strided("MaxPool", node, [node.inputs[0]], node.name, kernel_shape=node.window, pads=pads)
            case "ConcatV2":
                self.nodes.append(
                    helper.make_node("Concat", list(node.inputs[:-1]), [node.name], name=node.name, axis=1)
                )
            case unknown:
                raise ArtifactDamaged(f"the network's graph holds the operation {unknown}, which can't be translated")

    def _add_with(
        self, operation: str, node: Node, source: str, *values: AnyArray | np.float32 | None, **attributes: Any
    ) -> None:
        """Add an operation with constants of its own; None is one that is left out."""
        inputs = [source]
        for place, value in enumerate(values):
            inputs.append("" if value is None else f"{node.name}/constant{place}")
            if value is not None:
                self.constants.append(numpy_helper.from_array(np.asarray(value), inputs[-1]))
        self.nodes.append(helper.make_node(operation, inputs, [node.name], name=node.name, **attributes))

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
        if all(constant.name != name for constant in self.constants):
            self.constants.append(numpy_helper.from_array(np.ascontiguousarray(values, np.float32), name))
        return name

    def _value(self, name: str) -> AnyArray:
        value = self._values.get(name)
        if value is None:
            raise ArtifactDamaged(f"the network's graph has no constant named {name}")
        return value


def _pads(node: Node, window: Sequence[int]) -> list[int]:
    """TensorFlow's padding as explicit numbers: top, left, bottom, right.

    Those of SAME hold for sizes that the strides divide, which is why the image's must be multiples of 8. The odd one
    of an uneven padding goes to the bottom and the right.
    """
    if node.padding == "VALID":
        return [0, 0, 0, 0]
    if node.padding != "SAME":
        raise ArtifactDamaged(f"{node.name} of the network's graph is padded {node.padding}, which isn't known here")
    total = [max(size - stride, 0) for size, stride in zip(window, node.strides, strict=True)]
    before = [size // 2 for size in total]
    return before + [size - first for size, first in zip(total, before, strict=True)]


def _tensor_info(
    name: str, channels: int, rows: int | str | None, columns: int | str | None, *, batch: int | str = "n"
) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, [batch, channels, rows, columns])
