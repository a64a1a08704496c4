"""The numbers of a message, and the message with one of them replaced, as a client without checks may send it."""

import math
from collections.abc import Iterator
from typing import Any, TypeAlias, cast

import msgspec
import numpy as np
from msgspec import Struct

from protocol.array_part import ELEMENT_TYPES, ArrayDescription
from protocol.compliance.wire import changed

Path: TypeAlias = tuple[str | int, ...]

IMPOSSIBLE = (math.nan, math.inf, -math.inf, 1e300, -1e300)
"""Values that no number of a scene, a camera or a filter can have."""

ODD = (*IMPOSSIBLE, 0.0, -1.0)

_BODY, _FIRST_ARRAY = 2, 3


class Number(Struct, frozen=True):
    """A number in a message.

    Attributes:
        path: names and indices, from the body's root.
        value: None for an array's element.
        whole: whether it is an integer.
        array: the array whose last element it is; None for a number in the body itself.
    """

    path: Path
    value: float | None = None
    whole: bool = False
    array: ArrayDescription | None = None

    @property
    def field(self) -> str:
        """The name of its field."""
        return [name for name in self.path if isinstance(name, str)][-1]

    @property
    def words(self) -> str:
        """The path as text, for messages."""
        return ".".join(map(str, self.path))


def numbers_of(parts: list[bytes]) -> list[Number]:
    """Every number in a message's body, and one element of each array of floats."""
    return list(_numbers(msgspec.msgpack.decode(parts[_BODY]), ()))


def with_number(parts: list[bytes], number: Number, value: float) -> list[bytes]:
    """The message with another value of a number; an integer stays one if the value can be one."""
    parts = [*parts]
    if number.array is None:
        parts[_BODY] = changed(parts[_BODY], lambda body: _put(body, number.path, _as_sent(value, whole=number.whole)))
    else:
        place = _FIRST_ARRAY + number.array.index
        elements = np.frombuffer(parts[place], ELEMENT_TYPES[number.array.dtype]).copy()
        with np.errstate(over="ignore"):
            elements[-1] = value
        parts[place] = elements.tobytes()
    return parts


def _numbers(value: Any, path: Path) -> Iterator[Number]:
    match value:
        case bool():
            pass
        case int() | float():
            yield Number(path, value=value, whole=isinstance(value, int))
        case {"dtype": str(), "shape": list(), "index": int()}:
            array = msgspec.convert(value, ArrayDescription)
            if array.dtype.startswith("float") and math.prod(array.shape):
                yield Number(path, array=array)
        case dict() | list():
            inside = cast("dict[str, Any] | list[Any]", value)
            for key, inner in inside.items() if isinstance(inside, dict) else enumerate(inside):
                yield from _numbers(inner, (*path, key))
        case _:
            pass


def _put(body: Any, path: Path, value: float) -> None:
    *outer, last = path
    for key in outer:
        body = body[key]
    body[last] = value


def _as_sent(value: float, *, whole: bool) -> float:
    return int(value) if whole and value in (0.0, -1.0) else value
