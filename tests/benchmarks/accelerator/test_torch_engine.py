import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from benchmarks.accelerator.torch_engine import TorchEngine
from perception_worker.networks.onnxruntime_engine import OnnxRuntimeEngine
from protocol.errors import Unavailable

SIZE = 16, 24


def saved(tmp_path, nodes, constants=()):
    image = helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, *SIZE])
    result = helper.make_tensor_value_info("result", TensorProto.FLOAT, None)
    graph = helper.make_graph(nodes, "small", [image], [result], list(constants))
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    file = tmp_path / "small.onnx"
    onnx.save(model, file)
    return file


def small_network(tmp_path):
    """Every operation that the default network has, with paddings that are not the same on all sides."""
    rng = np.random.default_rng(0)
    weights = {
        "w1": rng.normal(size=(6, 3, 3, 3)),
        "b1": rng.normal(size=6),
        "w2": rng.normal(size=(6, 1, 3, 3)),
    }
    constants = [numpy_helper.from_array(array.astype(np.float32), name) for name, array in weights.items()]
    nodes = [
        helper.make_node("Conv", ["image", "w1", "b1"], ["c1"], pads=[0, 0, 1, 1], strides=[2, 2], kernel_shape=[3, 3]),
        helper.make_node("Relu", ["c1"], ["r1"]),
        helper.make_node("Conv", ["r1", "w2"], ["c2"], pads=[1, 1, 1, 1], group=6, kernel_shape=[3, 3]),
        helper.make_node("MaxPool", ["c2"], ["p"], pads=[0, 0, 1, 1], strides=[1, 1], kernel_shape=[2, 2]),
        helper.make_node("Concat", ["r1", "p"], ["both"], axis=1),
        helper.make_node("Identity", ["both"], ["result"]),
    ]
    return saved(tmp_path, nodes, constants)


def test_a_network_gives_what_it_gives_on_onnx_runtime(tmp_path):
    file = small_network(tmp_path)
    image = np.random.default_rng(1).normal(size=(3, *SIZE)).astype(np.float32)
    expected = OnnxRuntimeEngine(file, input_size=SIZE, default_size=SIZE, threads=1).run(image)["result"]
    engine = TorchEngine(file, input_size=SIZE, device="cpu")
    np.testing.assert_allclose(engine.run(image)["result"], expected, atol=1e-5)
    assert engine.outputs == {"result": expected.shape}


def test_an_operation_that_is_not_known_is_named(tmp_path):
    file = saved(tmp_path, [helper.make_node("Sigmoid", ["image"], ["result"])])
    with pytest.raises(Unavailable, match="Sigmoid"):
        TorchEngine(file, input_size=SIZE, device="cpu")
