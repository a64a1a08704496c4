"""A network as TensorFlow.js publishes it: its graph in JSON, its weights in one file beside it.

It becomes the same nodes as a frozen TensorFlow graph's. TensorFlow.js fuses a convolution with the bias and the
activation that follow it; here they are apart again.
"""

import base64
import math
from collections.abc import Generator
from typing import Any

import msgspec
import numpy as np

from perception_worker.networks.tensorflow_graph import Node
from protocol.arrays import AnyArray
from protocol.errors import ArtifactDamaged
from protocol.text import UNDECODABLE

_UNFUSED = {"_FusedConv2D": "Conv2D", "FusedDepthwiseConv2dNative": "DepthwiseConv2dNative"}


def read_tfjs(model: bytes, weights: bytes) -> tuple[Node, ...]:
    """Parse a graph model; its nodes come after the nodes that feed them.

    Args:
        model: the JSON file.
        weights: all that its weights manifest lists, one after the other.

    Raises:
        ArtifactDamaged: the file is no graph model, the weights are of another length, or a convolution is dilated.
    """
    try:
        described = msgspec.json.decode(model)
        constants = _constants(described["weightsManifest"], weights)
        return tuple(node for found in described["modelTopology"]["node"] for node in _nodes(found, constants))
    except (*UNDECODABLE, KeyError, TypeError, ValueError) as error:
        raise ArtifactDamaged(f"the network's file is no graph model of TensorFlow.js: {error!r}") from error


def _constants(manifest: list[dict[str, Any]], weights: bytes) -> dict[str, AnyArray]:
    constants: dict[str, AnyArray] = {}
    start = 0
    for weight in (weight for group in manifest for weight in group["weights"]):
        stored = np.dtype(weight.get("quantization", weight)["dtype"]).newbyteorder("<")
        count = math.prod(weight["shape"])
        values = np.frombuffer(weights, stored, count, start).reshape(weight["shape"])
        constants[weight["name"]] = values.astype(weight["dtype"])
        start += count * stored.itemsize
    if start != len(weights):
        raise ArtifactDamaged(f"the network's weights are {len(weights)} bytes, not {start}")
    return constants


def _nodes(found: dict[str, Any], constants: dict[str, AnyArray]) -> Generator[Node]:
    name, operation = found["name"], found["op"]
    inputs = [each.removesuffix(":0") for each in found.get("input", [])]
    if operation not in _UNFUSED:
        yield _node(found, name, operation, inputs, constants.get(name))
        return
    fused = [base64.b64decode(each).decode() for each in found["attr"]["fused_ops"]["list"]["s"]]
    names = [f"{name}/convolution", *(f"{name}/{each}" for each in fused[:-1]), name]
    yield _node(found, names[0], _UNFUSED[operation], inputs[:2])
    for each, before, after in zip(fused, names, names[1:], strict=False):
        yield Node(after, each, (before, inputs[2]) if each == "BiasAdd" else (before,))


def _node(found: dict[str, Any], name: str, operation: str, inputs: list[str], value: AnyArray | None = None) -> Node:
    attributes = found.get("attr", {})
    if set(_integers(attributes.get("dilations"))) - {1}:
        raise ArtifactDamaged(f"{name} of the network's graph is dilated, which isn't known here")
    return Node(
        name=name,
        operation=operation,
        inputs=tuple(inputs),
        strides=_integers(attributes.get("strides"))[1:3],
        window=_integers(attributes.get("ksize"))[1:3],
        padding=base64.b64decode(attributes["padding"]["s"]).decode() if "padding" in attributes else "",
        value=value,
    )


def _integers(attribute: dict[str, Any] | None) -> tuple[int, ...]:
    return () if attribute is None else tuple(map(int, attribute["list"]["i"]))
