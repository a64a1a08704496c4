"""The array types of messages, and the checks on their shapes and elements.

A field's annotation has the element type, which the codec checks, and as `Elements` the shape and the elements' bounds,
which are checked whenever a struct is made or received (`protocol.message.Value`). A struct itself checks a shape that
depends on another field.
"""

import sys
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, NamedTuple, TypeAlias, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

UInt8Array: TypeAlias = NDArray[np.uint8]
Float32Array: TypeAlias = NDArray[np.float32]
Float64Array: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
AnyArray: TypeAlias = NDArray[np.generic]
Shape: TypeAlias = tuple[int | None, ...]

GREATEST = sys.float_info.max


class WrongArray(ValueError):
    """An array does not match its description or its field's shape: a mistake of the sender.

    msgspec turns it into a validation error with the field's path, which the codec reports as `MalformedMessage`.
    """


class Elements(NamedTuple):
    """What an annotated array holds: `Annotated[Float64Array, Elements((18, 3))]`.

    Attributes:
        shape: None stands for any size.
        lowest, highest: inclusive bounds of all elements; by default any finite number.
        or_nan: whether NaN is allowed, for unknown values.
        or_anything: whether all numbers are allowed, also infinities: a sensor's readings.
    """

    shape: Shape
    lowest: float = -GREATEST
    highest: float = GREATEST
    or_nan: bool = False
    or_anything: bool = False


def require_shape(name: str, array: AnyArray, shape: Shape) -> None:
    """Raise `WrongArray` unless `array` has `shape`, in which None stands for any size."""
    if array.shape == shape:
        return
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = "×".join("any" if size is None else str(size) for size in shape)
        raise WrongArray(f"{name} has shape {array.shape}, not {wanted}")


def require_elements(struct: object) -> None:
    """Check a struct's arrays against the `Elements` in its annotations.

    Raises:
        WrongArray: an array has another shape.
        ValueError: an element is out of bounds; the message names the field and the element.
    """
    for name, elements in elements_of(type(struct)):
        array = getattr(struct, name)
        if array is not None:
            require_shape(name, array, elements.shape)
            if array.dtype.kind == "f" and not _are_within(array, elements):
                raise ValueError(_first_beyond(name, array, elements))


@cache
def elements_of(kind: type) -> tuple[tuple[str, Elements], ...]:
    """The fields of a struct's type that are annotated with `Elements`."""
    return tuple(
        (name, elements)
        for name, annotation in get_type_hints(kind, include_extras=True).items()
        for elements in _annotated(annotation)
    )


def _annotated(annotation: Any) -> Iterator[Elements]:
    """The `Elements` in a field's annotation, also in an optional one."""
    if get_origin(annotation) is Annotated:
        yield from (one for one in annotation.__metadata__ if isinstance(one, Elements))
    else:
        for part in get_args(annotation):
            if get_origin(part) is Annotated:
                yield from _annotated(part)


def _are_within(array: NDArray[Any], elements: Elements) -> bool:
    if elements.or_anything or not array.size:
        return True
    # fmin and fmax ignore NaN, minimum and maximum do not. Comparisons with NaN are false.
    if elements.or_nan:
        lowest, highest = float(np.fmin.reduce(array, axis=None)), float(np.fmax.reduce(array, axis=None))
        return not (lowest < elements.lowest or highest > elements.highest)
    lowest, highest = float(np.minimum.reduce(array, axis=None)), float(np.maximum.reduce(array, axis=None))
    return lowest >= elements.lowest and highest <= elements.highest


def _first_beyond(name: str, array: NDArray[Any], elements: Elements) -> str:
    # As doubles: a bound may be more than the elements' own type holds.
    array = array.astype(np.float64)
    within = (array >= elements.lowest) & (array <= elements.highest)
    beyond = ~(within | np.isnan(array)) if elements.or_nan else ~within
    place = tuple(np.argwhere(beyond)[0].tolist())
    allowed = "finite"
    if elements[1:3] != (-GREATEST, GREATEST):
        allowed += f" and from {elements.lowest:g} to {elements.highest:g}"
    return f"{name}{list(place)} is {array[place]:g}; it must be {allowed}" + (" or NaN" if elements.or_nan else "")
