"""An array in a message: its description in the body, its elements in a part of their own.

Elements are little-endian and in C order. A received array is a read-only view of its part.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Annotated, Any, TypeAlias, get_args

import msgspec
import numpy as np
from msgspec import Meta, Struct

from protocol.arrays import AnyArray, WrongArray
from protocol.errors import InvalidInput
from protocol.limits import Limits

Part: TypeAlias = bytes | memoryview
Size: TypeAlias = Annotated[int, Meta(ge=0)]

ELEMENT_TYPES: dict[str, np.dtype[Any]] = {
    "bool": np.dtype("?"),
    "uint8": np.dtype("u1"),
    "uint16": np.dtype("<u2"),
    "int32": np.dtype("<i4"),
    "int64": np.dtype("<i8"),
    "float32": np.dtype("<f4"),
    "float64": np.dtype("<f8"),
}
"""The element types that can be sent: none with pointers, strings or structures."""

_NAMES = {dtype: name for name, dtype in ELEMENT_TYPES.items()}


class ArrayDescription(Struct, frozen=True):
    """The description of an array in a body; `index` counts the message's array parts from 0."""

    dtype: str
    shape: Annotated[tuple[Size, ...], Meta(max_length=8)]
    index: Size


def array_part(array: AnyArray) -> tuple[str, Part]:
    """The name of an array's element type, and its elements, which are copied only if they are in another order.

    Raises:
        InvalidInput: arrays of this element type can't be sent.
    """
    # NumPy builds the name of a type at each access, which takes time.
    name = _NAMES.get(array.dtype) or array.dtype.name
    if name not in ELEMENT_TYPES:
        raise InvalidInput(f"an array of {name} can't be sent; one of {', '.join(ELEMENT_TYPES)} can")
    ordered = np.asarray(array, dtype=ELEMENT_TYPES[name], order="C")
    # A memoryview of an empty array can't be cast to bytes.
    return name, ordered.data.cast("B") if ordered.size else b""


class ArrayParts:
    """The array parts of one received message; each is taken once."""

    def __init__(self, parts: Sequence[Part], limits: Limits) -> None:
        self._parts = parts
        self._limits = limits
        self._taken: set[int] = set()

    def take(self, annotation: Any, described: Any) -> AnyArray:
        """The array that a field annotated with `annotation` describes.

        Raises:
            WrongArray: the description breaks a rule; msgspec adds the field's path.
        """
        description = _described(described)
        dtype = _element_type(description.dtype, annotation)
        part = self._take_part(description.index)
        _require_size(description, dtype, part, self._limits.array_bytes)
        array = np.frombuffer(part, dtype).reshape(description.shape)
        if dtype.kind == "b" and array.size and array.view(np.uint8).max() > 1:
            raise WrongArray("a bool is 0 or 1")
        array.flags.writeable = False
        return array

    def require_all_taken(self) -> None:
        """Raise `WrongArray` where a part belongs to no field."""
        if len(self._taken) != len(self._parts):
            raise WrongArray(f"{len(self._parts)} array parts came, the body describes {len(self._taken)}")

    def _take_part(self, index: int) -> Part:
        if index >= len(self._parts):
            raise WrongArray(f"array part {index} is not there")
        if index in self._taken:
            raise WrongArray(f"array part {index} is described twice")
        self._taken.add(index)
        return self._parts[index]


def _described(body: Any) -> ArrayDescription:
    try:
        return msgspec.convert(body, ArrayDescription)
    except msgspec.ValidationError as error:
        raise WrongArray(str(error)) from error


def _element_type(name: str, annotation: Any) -> np.dtype[Any]:
    dtype = ELEMENT_TYPES.get(name)
    if dtype is None:
        raise WrongArray(f"arrays of {name!r} don't travel")
    wanted = _annotated_type(annotation)
    if wanted != dtype:
        raise WrongArray(f"an array of {name} came where {wanted.name} belongs")
    return dtype


@cache
def _annotated_type(annotation: Any) -> np.dtype[Any]:
    """The element type of `NDArray[np.float32]`, which reads `ndarray[tuple[Any, ...], dtype[float32]]`."""
    return np.dtype(get_args(get_args(annotation)[1])[0])


def _require_size(description: ArrayDescription, dtype: np.dtype[Any], part: Part, most: int) -> None:
    size = math.prod(description.shape) * dtype.itemsize
    if size != len(part):
        raise WrongArray(f"{description.dtype} of shape {description.shape} takes {size} bytes, {len(part)} came")
    # An empty array's other dimensions are held to the cap too: numpy can't count beyond it.
    if size == 0 and math.prod(max(length, 1) for length in description.shape) * dtype.itemsize > most:
        raise WrongArray(f"shape {description.shape} is larger than any array may be")
