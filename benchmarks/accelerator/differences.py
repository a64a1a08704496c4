"""Differences between two devices' results."""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray


class Difference(Struct, frozen=True):
    """Of one quantity, between two devices.

    Attributes:
        median, largest: of the absolute differences, where both have a number.
        unequal: share of the values that are not the same.
        one_sided: how many values only one of the two has.
    """

    quantity: str
    median: float
    largest: float
    unequal: float
    one_sided: int


QUANTITIES: Mapping[str, tuple[str, float]] = {
    "rgb": ("colours, levels of 255", 1.0),
    "depth": ("depth, mm", 1e3),
    "heatmaps": ("heatmaps", 1.0),
    "keypoints": ("keypoints, px", 1.0),
    "points": ("points, mm", 1e3),
    "quality": ("quality", 1.0),
    "filter_mean": ("filter's mean, mm", 1e3),
    "filter_variance": ("filter's variance, m²", 1.0),
    "weights": ("weights", 1.0),
}
"""The compared arrays: name and unit, and the factor to that unit."""


def differences(expected: Mapping[str, NDArray[Any]], found: Mapping[str, NDArray[Any]]) -> list[Difference]:
    """Of every array that both have; what stands before a slash in an array's name is said with the quantity."""
    return [_difference(name, expected[name], found[name]) for name in expected if name in found]


def _difference(name: str, expected: NDArray[Any], found: NDArray[Any]) -> Difference:
    what, _, kind = name.rpartition("/")
    text, scale = QUANTITIES[kind]
    return difference(f"{what}: {text}" if what else text, _scaled(expected, scale), _scaled(found, scale))


def difference(quantity: str, expected: NDArray[Any], found: NDArray[Any]) -> Difference:
    """Between two arrays of one shape; NaN is no number."""
    both = np.isfinite(expected) & np.isfinite(found)
    apart = np.abs(expected[both] - found[both])
    one_sided = int((np.isfinite(expected) != np.isfinite(found)).sum())
    if apart.size == 0:
        return Difference(quantity, 0.0, 0.0, 0.0, one_sided)
    return Difference(quantity, float(np.median(apart)), float(apart.max()), float((apart > 0).mean()), one_sided)


def _scaled(values: NDArray[Any], scale: float) -> NDArray[Any]:
    # Pictures stay in single precision: there are many of them.
    return values.astype(np.result_type(values.dtype, np.float32)) * np.float32(scale)


def digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Of the arrays' bytes, in the order of their names."""
    found: Any = hashlib.sha256()
    for name in sorted(arrays):
        found.update(name.encode())
        found.update(np.ascontiguousarray(arrays[name]).tobytes())
    return found.hexdigest()[:16]
