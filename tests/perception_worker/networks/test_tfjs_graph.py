import json

import cv2
import numpy as np
import onnxruntime
import pytest

from perception_worker.networks.onnx_export import export_part
from perception_worker.networks.tfjs_graph import read_tfjs
from protocol.errors import ArtifactDamaged
from tests.perception_worker import tiny_package
from tests.perception_worker.networks.test_onnx_export import convolve
from tests.perception_worker.tiny_package import TFJS_CUT, tiny_tfjs


def by_hand(image):
    """What the tiny graph computes between the cuts, from the definitions of its operations; (rows, columns, 17)."""
    first = np.clip(convolve(image, tiny_package.TFJS_FIRST, stride=1) + tiny_package.TFJS_BIAS, 0, 6)
    rows, columns, channels = first.shape
    # Padding by one below and to the right, and then none, is what SAME is for a window of three and a stride of two.
    depthwise = convolve(first, tiny_package.TFJS_DEPTHWISE, stride=2, depthwise=True) + tiny_package.TFJS_BIAS
    pool = first.reshape(rows // 2, 2, columns // 2, 2, channels).max(axis=(1, 3))
    doubled = cv2.resize(depthwise + pool, (columns, rows), interpolation=cv2.INTER_LINEAR)
    return 1 / (1 + np.exp(-(np.clip(doubled, 0, 6) @ tiny_package.TFJS_LAST[0, 0].astype(float))))


def test_a_part_of_the_graph_computes_what_it_says():
    image = np.random.default_rng(3).uniform(-1, 1, (16, 24, 3)).astype(np.float32)
    model = export_part(read_tfjs(*tiny_tfjs()), "tiny", **TFJS_CUT)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    (heatmaps,) = session.run(["heatmaps"], {"image": image.transpose(2, 0, 1)[None]})
    assert heatmaps[0].transpose(1, 2, 0) == pytest.approx(by_hand(image), rel=1e-4, abs=1e-5)


def test_nothing_outside_of_the_cut_is_translated():
    model = export_part(read_tfjs(*tiny_tfjs()), "tiny", **TFJS_CUT)
    assert not {"Mul", "ArgMax"} & {node.op_type for node in model.graph.node}


def test_a_node_that_is_not_there_is_named():
    cut = TFJS_CUT | {"ends": {"heatmaps": ("nowhere", 17)}}
    with pytest.raises(ArtifactDamaged, match="no node named nowhere"):
        export_part(read_tfjs(*tiny_tfjs()), "tiny", **cut)


def test_an_operation_that_is_not_known_is_named():
    cut = TFJS_CUT | {"ends": {"heatmaps": ("decoder", 17)}}
    with pytest.raises(ArtifactDamaged, match="ArgMax"):
        export_part(read_tfjs(*tiny_tfjs()), "tiny", **cut)


@pytest.mark.parametrize("bytes_more", [-2, 2])
def test_weights_of_another_length_are_refused(bytes_more):
    model, weights = tiny_tfjs()
    changed = weights[:bytes_more] if bytes_more < 0 else weights + bytes(bytes_more)
    with pytest.raises(ArtifactDamaged):
        read_tfjs(model, changed)


@pytest.mark.parametrize("model", [b"no JSON", b"[]", b"{}", b'{"weightsManifest": [], "modelTopology": {}}'])
def test_what_is_no_graph_model_is_refused(model):
    with pytest.raises(ArtifactDamaged, match="no graph model"):
        read_tfjs(model, b"")


def test_a_dilated_convolution_is_refused():
    model, weights = tiny_tfjs()
    described = json.loads(model)
    node = next(node for node in described["modelTopology"]["node"] if node["name"] == "last")
    node["attr"]["dilations"]["list"]["i"] = ["1", "2", "2", "1"]
    with pytest.raises(ArtifactDamaged, match=r"last .* dilated"):
        read_tfjs(json.dumps(described).encode(), weights)
