"""Whether two messages say the same: arrays by type, shape and bytes, everything else by `==`."""

from typing import Any

import numpy as np
from msgspec import Struct, structs


def same(one: Any, other: Any) -> bool:
    """True where both are the same to the bit, NaN included."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, Struct):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in structs.fields(one))
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return bool(one == other or (one != one and other != other))
