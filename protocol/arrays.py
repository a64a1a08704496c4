"""The array types that messages carry, and the checks on their shapes.

An array's element type stands in its annotation, and the codec holds senders to it; its shape is the struct's to check.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

UInt8Array: TypeAlias = NDArray[np.uint8]
Float32Array: TypeAlias = NDArray[np.float32]
Float64Array: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
AnyArray: TypeAlias = NDArray[np.generic]


def require_shape(name: str, array: AnyArray, shape: tuple[int | None, ...]) -> None:
    """Raise `ValueError` unless `array` has `shape`, in which None stands for any size.

    msgspec turns a `ValueError` from a struct into a validation error, which the codec reports as `MalformedMessage`.
    """
    if array.shape == shape:
        return
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = "×".join("any" if size is None else str(size) for size in shape)
        raise ValueError(f"{name} has shape {array.shape}, not {wanted}")
