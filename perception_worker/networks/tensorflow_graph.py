"""A frozen TensorFlow graph, read without TensorFlow.

TensorFlow publishes its graphs as protocol buffers. The few messages that a frozen network uses are declared here, with
TensorFlow's own field numbers (`graph.proto`, `attr_value.proto`, `tensor.proto`), and protobuf does the parsing.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from protocol.arrays import AnyArray
from protocol.errors import ArtifactDamaged

_FieldType = descriptor_pb2.FieldDescriptorProto

# message -> (field, number, type, repeated); a type in capitals is one of protobuf's own.
_SCHEMA: dict[str, list[tuple[str, int, str, bool]]] = {
    "GraphDef": [("node", 1, "NodeDef", True)],
    "NodeDef": [
        ("name", 1, "STRING", False),
        ("op", 2, "STRING", False),
        ("input", 3, "STRING", True),
        ("attr", 5, "AttrEntry", True),
    ],
    "AttrEntry": [("key", 1, "STRING", False), ("value", 2, "AttrValue", False)],
    "AttrValue": [("list", 1, "ListValue", False), ("s", 2, "BYTES", False), ("tensor", 8, "TensorProto", False)],
    "ListValue": [("i", 3, "INT64", True)],
    "TensorProto": [
        ("dtype", 1, "INT32", False),
        ("tensor_shape", 2, "TensorShapeProto", False),
        ("tensor_content", 4, "BYTES", False),
        ("float_val", 5, "FLOAT", True),
        ("int_val", 7, "INT32", True),
    ],
    "TensorShapeProto": [("dim", 2, "Dim", True)],
    "Dim": [("size", 1, "INT64", False)],
}
_PACKAGE = "vantage.tensorflow"
_DTYPES = {1: np.dtype("<f4"), 3: np.dtype("<i4")}


@dataclass(frozen=True)
class Node:
    """One operation of the graph.

    Attributes:
        inputs: names of the nodes that feed it.
        strides, window: along rows and columns; empty where the operation has none.
        padding: TensorFlow's name for it, such as `SAME`.
        value: what a constant holds.
    """

    name: str
    operation: str
    inputs: tuple[str, ...]
    strides: tuple[int, ...] = ()
    window: tuple[int, ...] = ()
    padding: str = ""
    value: AnyArray | None = field(default=None, repr=False)


def read_graph(serialized: bytes) -> tuple[Node, ...]:
    """Parse a `GraphDef`; its nodes come after the nodes that feed them.

    Raises:
        ArtifactDamaged: the bytes are no graph, or hold a type of number that a float32 network doesn't use.
    """
    try:
        graph = graph_message_type().FromString(serialized)
    except DecodeError as error:
        raise ArtifactDamaged("the network's file is no TensorFlow graph") from error
    return tuple(_node(message) for message in graph.node)


def _node(message: Any) -> Node:
    attributes = {entry.key: entry.value for entry in message.attr}
    value = attributes.get("value")
    return Node(
        name=message.name,
        operation=message.op,
        inputs=tuple(message.input),
        strides=_rows_and_columns(attributes.get("strides")),
        window=_rows_and_columns(attributes.get("ksize")),
        padding=attributes["padding"].s.decode() if "padding" in attributes else "",
        value=None if value is None else _array(value.tensor),
    )


def _rows_and_columns(attribute: Any) -> tuple[int, ...]:
    """The middle two of an attribute in TensorFlow's order: batch, rows, columns, channels."""
    return () if attribute is None else tuple(attribute.list.i[1:3])


def _array(tensor: Any) -> AnyArray:
    shape = tuple(dimension.size for dimension in tensor.tensor_shape.dim)
    dtype = _DTYPES.get(tensor.dtype)
    if dtype is None:
        raise ArtifactDamaged(f"the network's graph holds a constant of TensorFlow's type {tensor.dtype}")
    if tensor.tensor_content:
        return np.frombuffer(tensor.tensor_content, dtype).reshape(shape)
    # TensorFlow writes small constants as values, and one value stands for an array filled with it.
    values = np.array(tensor.float_val or tensor.int_val, dtype)
    return np.full(shape, values[0]) if values.size == 1 else values.reshape(shape)


def graph_message_type() -> Any:
    file = descriptor_pb2.FileDescriptorProto(name="vantage/graph.proto", package=_PACKAGE, syntax="proto3")
    for message_name, fields in _SCHEMA.items():
        message = file.message_type.add(name=message_name)
        for name, number, kind, repeated in fields:
            message.field.append(_field(name, number, kind, repeated=repeated))
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{_PACKAGE}.GraphDef"))


def _field(name: str, number: int, kind: str, *, repeated: bool) -> descriptor_pb2.FieldDescriptorProto:
    declared = _FieldType(name=name, number=number)
    declared.label = _FieldType.LABEL_REPEATED if repeated else _FieldType.LABEL_OPTIONAL
    if kind in _SCHEMA:
        declared.type, declared.type_name = _FieldType.TYPE_MESSAGE, f".{_PACKAGE}.{kind}"
    else:
        declared.type = _FieldType.Type.Value(f"TYPE_{kind}")
    return declared
