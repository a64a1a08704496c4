"""A package like the one that carries the pose network, with a network that can be checked by hand."""

import zipfile
from hashlib import sha256
from pathlib import Path

import numpy as np

from perception_worker.models import PublishedNetwork
from perception_worker.onnx_export import export
from perception_worker.tensorflow_graph import graph_message_type, read_graph

GRAPH_PATH = "tiny_pose_data/graph.pb"
WHEEL = "tiny_pose-1.0-cp37-cp37m-macosx_10_15_x86_64.whl"

RNG = np.random.default_rng(7)
FIRST = RNG.normal(size=(3, 3, 3, 4)).astype(np.float32)
DEPTHWISE = RNG.normal(size=(3, 3, 4, 2)).astype(np.float32)
BIAS = np.float32([0.5, -0.5, 0.25, 1.0])
HEATMAPS = RNG.normal(size=(1, 1, 12, 19)).astype(np.float32)
PAFS = RNG.normal(size=(1, 1, 12, 38)).astype(np.float32)


def tiny_graph():
    """A frozen graph with every operation that a MobileNet of OpenPose's kind has, its image halved three times."""
    graph = graph_message_type()()
    _node(graph, "image", "Placeholder")
    _convolution(graph, "first", "image", FIRST, stride=2, bias=BIAS)
    _node(graph, "relu", "Relu", "first/bias")
    _convolution(graph, "depthwise", "relu", DEPTHWISE, stride=2)
    pool = _node(graph, "pool", "MaxPool", "relu")
    _attribute(pool, "ksize").list.i.extend([1, 2, 2, 1])
    _attribute(pool, "strides").list.i.extend([1, 2, 2, 1])
    _attribute(pool, "padding").s = b"SAME"
    _constant(graph, "axis", np.int32(3))
    _node(graph, "both", "ConcatV2", "depthwise", "pool", "axis")
    _convolution(graph, "heat", "both", HEATMAPS, stride=2, bias=np.zeros(19, np.float32))
    _convolution(graph, "paf", "both", PAFS, stride=2, bias=np.full(38, 0.1, np.float32))
    _node(graph, "end", "ConcatV2", "heat/bias", "paf/bias", "axis")
    return graph


def tiny_network(wheel: Path, **others):
    """The network in the package, with the checksums of what is really there but for `others`."""
    graph = tiny_graph().SerializeToString()
    checksums = {
        "wheel_checksum": sha256(wheel.read_bytes()).hexdigest(),
        "graph_checksum": sha256(graph).hexdigest(),
        "onnx_checksum": sha256(export(read_graph(graph), "tiny").SerializeToString()).hexdigest(),
    }
    return PublishedNetwork(name="tiny", requirement="tiny-pose==1.0", graph_path=GRAPH_PATH, **(checksums | others))


def write_wheel(directory: Path) -> Path:
    """A wheel that pip takes for the platform that the real one was built for."""
    wheel = directory / WHEEL
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr(GRAPH_PATH, tiny_graph().SerializeToString())
        information = "tiny_pose-1.0.dist-info"
        archive.writestr(f"{information}/METADATA", "Metadata-Version: 2.1\nName: tiny-pose\nVersion: 1.0\n")
        tag = "Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: cp37-cp37m-macosx_10_15_x86_64\n"
        archive.writestr(f"{information}/WHEEL", tag)
        archive.writestr(f"{information}/RECORD", "")
    return wheel


def _node(graph, name, operation, *inputs):
    return graph.node.add(name=name, op=operation, input=inputs)


def _attribute(node, key):
    return node.attr.add(key=key).value


def _constant(graph, name, values):
    tensor = _attribute(_node(graph, name, "Const"), "value").tensor
    tensor.dtype = 3 if values.dtype == np.int32 else 1
    for size in values.shape:
        tensor.tensor_shape.dim.add(size=size)
    if values.size > 1 and (values == values.flat[0]).all():
        tensor.float_val.append(float(values.flat[0]))
    elif values.size == 1:
        tensor.int_val.append(int(values))
    else:
        tensor.tensor_content = values.tobytes()


def _convolution(graph, name, source, weights, *, stride, bias=None):
    depthwise = name == "depthwise"
    _constant(graph, f"{name}/weights", weights)
    node = _node(graph, name, "DepthwiseConv2dNative" if depthwise else "Conv2D", source, f"{name}/weights")
    _attribute(node, "strides").list.i.extend([1, stride, stride, 1])
    _attribute(node, "padding").s = b"SAME"
    if bias is not None:
        _constant(graph, f"{name}/offset", bias)
        _node(graph, f"{name}/bias", "BiasAdd", name, f"{name}/offset")
