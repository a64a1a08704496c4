"""Every number in a message or a configuration has bounds by its type, so it is finite."""

import math
from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import msgspec
import numpy as np
import pytest
from msgspec import Meta, Struct
from msgspec.structs import fields, force_setattr

from protocol.arrays import Elements, WrongArray, elements_of
from protocol.codec import decode, encode, open_envelope, seal
from protocol.config import RunConfig
from protocol.errors import ImpossibleValue, MalformedMessage
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Value
from protocol.messages import MESSAGE_NUMBERS, Render
from tests.protocol.values.samples import CAMERA, SCENE, samples

STRUCTS = (*MESSAGE_NUMBERS, RequestHeader, ReplyHeader, RunConfig)
HEADER = RequestHeader(request=1, incarnation="a", deadline=1.0)


def numbers(annotation: Any, path: str, bounds: Meta | None = None) -> Iterator[tuple[str, Meta | None]]:
    """Where floats are in a type, and what they are held to."""
    if get_origin(annotation) is Annotated:
        meta = [one for one in annotation.__metadata__ if isinstance(one, Meta)]
        yield from numbers(annotation.__origin__, path, meta[0] if meta else None)
    elif annotation is float:
        yield path, bounds
    elif isinstance(annotation, type) and issubclass(annotation, Struct):
        for field in fields(annotation):
            yield from numbers(field.type, f"{path}.{field.name}")
    elif get_origin(annotation) in (tuple, dict, list, Union, UnionType):
        for part in get_args(annotation):
            yield from numbers(part, path)


def is_bounded(bounds: Meta | None) -> bool:
    return bounds is not None and None not in (
        bounds.gt if bounds.ge is None else bounds.ge,
        bounds.lt if bounds.le is None else bounds.le,
    )


@pytest.mark.parametrize("kind", STRUCTS, ids=lambda kind: kind.__name__)
def test_every_float_has_a_bound_on_each_side(kind):
    assert [path for path, bounds in numbers(kind, kind.__name__) if not is_bounded(bounds)] == []


def carriers(kind: Any) -> Iterator[type[Value]]:
    """A type and what is in it that carries arrays."""
    if isinstance(kind, type) and issubclass(kind, Struct):
        if issubclass(kind, Value):
            yield kind
        for field in fields(kind):
            yield from carriers(field.type)
    else:
        for part in get_args(kind):
            yield from carriers(part)


def array_fields(kind: type[Value]) -> set[str]:
    return {field.name for field in fields(kind) if "ndarray" in str(field.type)}


@pytest.mark.parametrize(
    "kind", dict.fromkeys(one for kind in MESSAGE_NUMBERS for one in carriers(kind)), ids=lambda kind: kind.__name__
)
def test_every_array_says_what_its_elements_may_be(kind):
    assert {name for name, _ in elements_of(kind)} == array_fields(kind)


def values(message: object) -> Iterator[Value]:
    """A message and the structs in it that carry arrays."""
    if isinstance(message, Struct):
        if isinstance(message, Value):
            yield message
        for field in message.__struct_fields__:
            yield from values(getattr(message, field))
    elif isinstance(message, dict):
        for one in message.values():
            yield from values(one)


def decoded(message: Any) -> object:
    return decode(open_envelope(seal(encode(message, Limits()), HEADER), Limits()), Limits())


@pytest.mark.parametrize("message", samples(), ids=lambda message: type(message).__name__)
def test_arrays_are_held_to_that_by_whoever_receives_them(message):
    """A struct with rules of its own that forgets those of its root is found here."""
    for struct in values(message):
        for name, elements in elements_of(type(struct)):
            array = getattr(struct, name)
            if array is None or not array.size or array.dtype.kind != "f" or elements.or_anything:
                continue
            for wrong in (math.inf, -math.inf) if elements.or_nan else (math.nan, math.inf, -math.inf):
                spoilt = array.copy()
                spoilt.flat[-1] = wrong
                force_setattr(struct, name, spoilt)
                with pytest.raises(ImpossibleValue, match=rf"{name}\[.* is {wrong:g}; it must be finite"):
                    decoded(message)
            force_setattr(struct, name, array)
    decoded(message)


class TestWhatABrokenBoundIsCalled:
    """msgspec tells a broken bound and another type alike, but for its words: these must be known."""

    @pytest.mark.parametrize(
        ("field", "value", "path"),
        [
            ("yaw", math.nan, r"\$\.scene\.yaw"),
            ("yaw", math.inf, r"\$\.scene\.yaw"),
            ("position", [0.0, 1e300], r"\$\.scene\.position\[1\]"),
            ("identity", 60, r"\$\.scene\.identity"),
            ("appearance", -1, r"\$\.scene\.appearance"),
            ("appearance", 2**64 - 1, r"\$\.scene\.appearance"),
            ("sun", {"azimuth": 0.0, "elevation": -1.0}, r"\$\.scene\.sun\.elevation"),
        ],
    )
    def test_a_value_out_of_bounds_is_impossible(self, field, value, path):
        with pytest.raises(ImpossibleValue, match=path):
            self.render(**{field: value})

    @pytest.mark.parametrize(
        ("field", "value"), [("yaw", "north"), ("yaw", None), ("position", [0.0]), ("identity", 1.5), ("pose", 3)]
    )
    def test_a_value_of_another_type_is_malformed(self, field, value):
        with pytest.raises(MalformedMessage) as told:
            self.render(**{field: value})
        assert type(told.value) is MalformedMessage

    def render(self, **changes: object) -> None:
        parts = seal(encode(Render(scene=SCENE, camera=CAMERA), Limits()), HEADER)
        body = msgspec.msgpack.decode(parts[2])
        body["scene"] |= changes
        decode(open_envelope([*parts[:2], msgspec.msgpack.encode(body)], Limits()), Limits())


class Grid(Value, frozen=True, eq=False):
    """An array of a share or of nothing known."""

    cells: Annotated[np.ndarray[Any, np.dtype[np.float32]], Elements((2, None), 0.0, 1.0, or_nan=True)]


class TestElements:
    def test_bounds_themselves_and_nan_are_allowed(self):
        Grid(np.array([[0.0, 1.0], [np.nan, 0.5]], np.float32))
        Grid(np.full((2, 3), np.nan, np.float32))
        Grid(np.zeros((2, 0), np.float32))

    def test_the_first_element_that_is_beyond_is_named(self):
        with pytest.raises(ValueError, match=r"cells\[1, 0\] is 1.5; it must be finite and from 0 to 1 or NaN"):
            Grid(np.array([[0.0, np.nan], [1.5, 9.0]], np.float32))

    def test_another_shape_is_told_apart_from_a_wrong_value(self):
        with pytest.raises(WrongArray, match=r"cells has shape \(3, 1\), not 2×any"):
            Grid(np.zeros((3, 1), np.float32))
