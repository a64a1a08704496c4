import numpy as np
import onnxruntime
import pytest

from perception_worker.networks.onnx_export import export
from perception_worker.networks.tensorflow_graph import read_graph
from protocol.errors import ArtifactDamaged
from tests.perception_worker import tiny_package
from tests.perception_worker.tiny_package import tiny_graph


def run(model, image):
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return session.run(["heatmaps", "pafs"], {"image": image})


def convolve(image, weights, *, stride, depthwise=False):
    """TensorFlow's SAME convolution by its definition: (rows, columns, channels), sizes that the stride divides."""
    window = weights.shape[0]
    before = max(window - stride, 0) // 2
    padded = np.pad(image, ((before, window), (before, window), (0, 0)))
    rows, columns = image.shape[0] // stride, image.shape[1] // stride
    channels = weights.shape[2] * weights.shape[3] if depthwise else weights.shape[3]
    result = np.empty((rows, columns, channels))
    for row in range(rows):
        for column in range(columns):
            patch = padded[row * stride :, column * stride :][:window, :window]
            if depthwise:
                # Each channel of the image makes as many as the weights have for it, side by side.
                result[row, column] = (patch[..., None] * weights).sum(axis=(0, 1)).ravel()
            else:
                result[row, column] = np.tensordot(patch, weights, axes=3)
    return result


def by_hand(image):
    """What the tiny graph computes, from the definitions of its operations; (rows, columns, channels)."""
    relu = np.maximum(convolve(image, tiny_package.FIRST, stride=2) + tiny_package.BIAS, 0)
    depthwise = convolve(relu, tiny_package.DEPTHWISE, stride=2, depthwise=True)
    rows, columns, channels = relu.shape
    pool = relu.reshape(rows // 2, 2, columns // 2, 2, channels).max(axis=(1, 3))
    both = np.concatenate([depthwise, pool], axis=2)
    return convolve(both, tiny_package.HEATMAPS, stride=2), convolve(both, tiny_package.PAFS, stride=2) + 0.1


@pytest.mark.parametrize("size", [(16, 24), (32, 16)])
def test_the_exported_network_computes_what_the_graph_says(size):
    image = np.random.default_rng(3).uniform(0, 255, (*size, 3)).astype(np.float32)
    model = export(read_graph(tiny_graph().SerializeToString()), "tiny")
    heatmaps, pafs = run(model, image.transpose(2, 0, 1)[None])
    expected_heatmaps, expected_pafs = by_hand(image)
    assert heatmaps[0].transpose(1, 2, 0) == pytest.approx(expected_heatmaps, rel=1e-4, abs=1e-2)
    assert pafs[0].transpose(1, 2, 0) == pytest.approx(expected_pafs, rel=1e-4, abs=1e-2)


def test_a_graph_can_be_left_before_its_end():
    image = np.random.default_rng(3).uniform(0, 255, (16, 24, 3)).astype(np.float32)
    ends = {"heatmaps": "heat/bias", "pafs": "paf/bias"}
    # A stage after the ends, which nothing that is wanted comes out of.
    graph = tiny_graph()
    graph.node[-1].op = "FancyConcat"
    model = export(read_graph(graph.SerializeToString()), "tiny", ends)
    heatmaps, pafs = run(model, image.transpose(2, 0, 1)[None])
    assert heatmaps[0].transpose(1, 2, 0) == pytest.approx(by_hand(image)[0], rel=1e-4, abs=1e-2)
    assert pafs[0].transpose(1, 2, 0) == pytest.approx(by_hand(image)[1], rel=1e-4, abs=1e-2)
    with pytest.raises(ArtifactDamaged, match="no node named heat/stage7"):
        export(read_graph(graph.SerializeToString()), "tiny", ends | {"heatmaps": "heat/stage7"})


def test_the_same_graph_gives_the_same_bytes():
    graph = read_graph(tiny_graph().SerializeToString())
    assert export(graph, "tiny").SerializeToString() == export(graph, "tiny").SerializeToString()


def test_an_operation_that_is_not_known_is_named():
    graph = tiny_graph()
    graph.node[3].op = "FancyConv"
    graph.node[4].op = "LeakyRelu"
    with pytest.raises(ArtifactDamaged, match="FancyConv"):
        export(read_graph(graph.SerializeToString()), "tiny")


def test_a_graph_that_ends_otherwise_is_refused():
    graph = tiny_graph()
    del graph.node[-1]
    with pytest.raises(ArtifactDamaged, match="doesn't end with heatmaps"):
        export(read_graph(graph.SerializeToString()), "tiny")


def test_another_padding_is_refused():
    graph = tiny_graph()
    convolution = next(node for node in graph.node if node.op == "Conv2D")
    next(entry for entry in convolution.attr if entry.key == "padding").value.s = b"EXPLICIT"
    with pytest.raises(ArtifactDamaged, match="EXPLICIT"):
        export(read_graph(graph.SerializeToString()), "tiny")
