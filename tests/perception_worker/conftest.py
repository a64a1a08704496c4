from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from perception_worker.networks.models import KNOWN
from perception_worker.networks.onnx_export import export
from perception_worker.networks.tensorflow_graph import read_graph
from protocol.artifact import sha256
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import Frame
from tests.perception_worker.tiny_package import tiny_graph

PICTURE = Path(__file__).parent / "pictures" / "astronaut.jpg"


@pytest.fixture(scope="session")
def astronaut():
    """A photograph of a person from the waist up, (384, 384, 3) RGB."""
    return np.ascontiguousarray(cv2.imread(str(PICTURE))[..., ::-1])


@pytest.fixture
def frame():
    """An RGB-D frame of any picture and depth; the camera at the origin, 1.5 m high, looks along x."""

    def make(rgb, depth=3.0, **truth):
        height, width = rgb.shape[:2]
        camera = Camera(
            pose=CameraPose(position=(0.0, 0.0, 1.5), target=(3.0, 0.0, 1.5)),
            intrinsics=Intrinsics.from_horizontal_fov(width, height, 70.0),
        )
        depth = np.broadcast_to(np.asarray(depth, np.float32), (height, width))
        return Frame(rgb=rgb, depth=np.ascontiguousarray(depth), camera=camera, **truth)

    return make


@pytest.fixture(scope="session")
def tiny_onnx(tmp_path_factory):
    """A network of a few operations with the outputs of a pose network."""
    file = tmp_path_factory.mktemp("networks") / "tiny.onnx"
    file.write_bytes(export(read_graph(tiny_graph().SerializeToString()), "tiny").SerializeToString())
    return file


@pytest.fixture(scope="session")
def logits_onnx(tmp_path_factory):
    """A network with one output of three channels."""
    return write_network(
        tmp_path_factory.mktemp("networks") / "logits.onnx",
        nodes=[helper.make_node("Relu", ["image"], ["logits"])],
        outputs={"logits": 3},
    )


@pytest.fixture(scope="session")
def grey_onnx(tmp_path_factory):
    """A pose network for pictures of one channel."""
    weights = {"heatmaps": np.ones((19, 1, 1, 1), np.float32), "pafs": np.ones((38, 1, 1, 1), np.float32)}
    return write_network(
        tmp_path_factory.mktemp("networks") / "grey.onnx",
        channels=1,
        nodes=[helper.make_node("Conv", ["image", f"{name} weights"], [name]) for name in weights],
        outputs={name: len(values) for name, values in weights.items()},
        constants=[numpy_helper.from_array(values, f"{name} weights") for name, values in weights.items()],
    )


@pytest.fixture(scope="session")
def fixed_onnx(tmp_path_factory):
    """A pose network for images of one size, with all of its maps in one output."""
    weights = np.random.default_rng(2).normal(size=(57, 3, 1, 1)).astype(np.float32)
    return write_network(
        tmp_path_factory.mktemp("networks") / "fixed.onnx",
        size=(72, 88),
        nodes=[helper.make_node("Conv", ["image", "weights"], ["maps"])],
        outputs={"maps": 57},
        constants=[numpy_helper.from_array(weights, "weights")],
    )


@pytest.fixture(scope="session")
def nan_onnx(tmp_path_factory):
    """A pose network that takes the square root of a negative number in the middle of its heatmaps."""
    weights = {"under root": np.full((19, 3, 1, 1), -1, np.float32), "fields": np.ones((38, 3, 1, 1), np.float32)}
    return write_network(
        tmp_path_factory.mktemp("networks") / "nan.onnx",
        nodes=[
            helper.make_node("Conv", ["image", "under root"], ["negative"]),
            helper.make_node("Sqrt", ["negative"], ["heatmaps"]),
            helper.make_node("Conv", ["image", "fields"], ["pafs"]),
        ],
        outputs={"heatmaps": 19, "pafs": 38},
        constants=[numpy_helper.from_array(values, name) for name, values in weights.items()],
    )


@pytest.fixture(scope="session")
def damaged_onnx(tmp_path_factory):
    """A pose network whose weights are not numbers."""
    weights = {name: np.full((count, 3, 1, 1), np.nan, np.float32) for name, count in (("heatmaps", 19), ("pafs", 38))}
    return write_network(
        tmp_path_factory.mktemp("networks") / "damaged.onnx",
        nodes=[helper.make_node("Conv", ["image", f"{name} weights"], [name]) for name in weights],
        outputs={name: len(values) for name, values in weights.items()},
        constants=[numpy_helper.from_array(values, f"{name} weights") for name, values in weights.items()],
    )


@pytest.fixture
def movenet_of_other_outputs(tmp_path, monkeypatch):
    """A network with one output of three channels, taken for MoveNet's file."""
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))
    file = write_network(
        tmp_path / "movenet_lightning.onnx",
        nodes=[helper.make_node("Relu", ["image"], ["logits"])],
        outputs={"logits": 3},
    )
    own = replace(KNOWN["movenet_lightning"], onnx_checksum=sha256(file))
    monkeypatch.setitem(KNOWN, "movenet_lightning", own)


@pytest.fixture(scope="session")
def integer_onnx(tmp_path_factory):
    """A pose network for images of whole numbers."""
    weights = {"heatmaps": np.ones((19, 3, 1, 1), np.float32), "pafs": np.ones((38, 3, 1, 1), np.float32)}
    return write_network(
        tmp_path_factory.mktemp("networks") / "integer.onnx",
        image_type=TensorProto.INT32,
        nodes=[
            helper.make_node("Cast", ["image"], ["real"], to=TensorProto.FLOAT),
            *(helper.make_node("Conv", ["real", f"{name} weights"], [name]) for name in weights),
        ],
        outputs={name: len(values) for name, values in weights.items()},
        constants=[numpy_helper.from_array(values, f"{name} weights") for name, values in weights.items()],
    )


def write_network(file, *, nodes, outputs, channels=3, constants=(), size=("h", "w"), image_type=TensorProto.FLOAT):
    def maps(name, count, kind=TensorProto.FLOAT):
        return helper.make_tensor_value_info(name, kind, ["n", count, *size])

    results = [maps(name, count) for name, count in outputs.items()]
    graph = helper.make_graph(nodes, file.stem, [maps("image", channels, image_type)], results, list(constants))
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    file.write_bytes(model.SerializeToString())
    return file
