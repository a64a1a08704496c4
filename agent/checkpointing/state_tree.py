"""Nested state as two files' content: arrays by name, and the rest as msgpack. Reading it executes nothing."""

from typing import Any

import msgspec
import numpy as np
from msgspec.msgpack import Ext
from numpy.typing import NDArray

from protocol.errors import ArtifactDamaged, InvalidInput

_TENSOR, _ARRAY, _INTEGER = 1, 2, 3
"""Extension types of msgpack: a torch tensor and a NumPy array, by their names, and an integer past 64 bits."""


def split(state: dict[str, Any]) -> tuple[dict[str, NDArray[Any]], bytes]:
    """The arrays and tensors of nested dicts and lists, each named by the way to it; and the rest, as msgpack.

    Raises:
        InvalidInput: two arrays have the same name.
    """
    arrays: dict[str, NDArray[Any]] = {}
    rest = _without_arrays(state, "", arrays)
    return arrays, msgspec.msgpack.encode(rest)


def join(arrays: dict[str, NDArray[Any]], rest: bytes) -> dict[str, Any]:
    """The nested state that was split; tuples have become lists.

    Raises:
        ArtifactDamaged: an array is missing, or `rest` is not what `split` gave.
    """
    # Imported here, since torch takes seconds to load; a process with a state to join has loaded it anyway.
    import torch

    def value_of(code: int, data: memoryview) -> Any:
        text = bytes(data).decode()
        if code == _INTEGER:
            return int(text)
        return torch.from_numpy(arrays[text].copy()) if code == _TENSOR else arrays[text]

    try:
        return msgspec.msgpack.decode(rest, ext_hook=value_of)
    except (msgspec.MsgspecError, KeyError, ValueError) as error:
        raise ArtifactDamaged(f"the state can't be put together: {error}") from error


def _without_arrays(value: Any, name: str, arrays: dict[str, NDArray[Any]]) -> Any:
    import torch

    if isinstance(value, dict):
        return {key: _without_arrays(item, f"{name}.{key}", arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_arrays(item, f"{name}.{index}", arrays) for index, item in enumerate(value)]
    if isinstance(value, torch.Tensor):
        return _named(_TENSOR, name, value.detach().cpu().numpy(), arrays)
    if isinstance(value, np.ndarray):
        return _named(_ARRAY, name, value, arrays)
    if isinstance(value, int) and not -(2**63) <= value < 2**64:
        return Ext(_INTEGER, str(value).encode())
    return value


def _named(code: int, name: str, array: NDArray[Any], arrays: dict[str, NDArray[Any]]) -> Ext:
    name = name.removeprefix(".")
    if name in arrays:
        raise InvalidInput(f"a state has two arrays that are called {name}")
    arrays[name] = np.asarray(array, order="C")
    return Ext(code, name.encode())
