"""A network's inputs and outputs as its file declares them, checked against the input and outputs that we need.

An engine would silently reshape a network, cast a picture or a map, or drop one. So each engine reads the file's own
signature first, and a network that does not fit is refused when it is opened.
"""

import logging
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from protocol.arrays import Float32Array
from protocol.errors import InvalidConfig

_logger = logging.getLogger(__name__)

Size: TypeAlias = tuple[int, int]
"""Rows and columns."""

FLOATS: Mapping[str, type[np.floating]] = {"float32": np.float32, "float16": np.float16, "float64": np.float64}
"""Kinds of numbers that pictures and maps may be of. numpy has no bfloat16, and reads it as something else."""

COLOURS = 3


@dataclass(frozen=True)
class TensorSpec:
    """An input or an output, as the file declares it.

    Attributes:
        shape: with None for each side that may be any; None where there may be any number of sides.
        kind: of its numbers; in numpy's words for `FLOATS`, in the engine's for others.
    """

    name: str
    shape: tuple[int | None, ...] | None
    kind: str

    @property
    def words(self) -> str:
        """The tensor in words, for messages."""
        sides = "…" if self.shape is None else ", ".join("any" if side is None else str(side) for side in self.shape)
        return f"{self.name} {self.kind} [{sides}]"


def image_size(inputs: Sequence[TensorSpec], file: Path, wanted: Size | None, default: Size) -> Size:
    """The size of a network's images: the wanted one, else its own, else the default.

    Raises:
        InvalidConfig: it does not take one image of three colours of that size; the message tells what it takes.
    """
    size = wanted or (_own_size(inputs[0].shape, default) if inputs else default)
    if len(inputs) != 1 or inputs[0].kind not in FLOATS or not _takes(inputs[0].shape, (1, COLOURS, *size)):
        taken = ", ".join(one.words for one in inputs) or "nothing"
        rows, columns = size
        raise InvalidConfig(
            f"perception.network: {file} takes {taken}, and is to be shown one float32 [1, {COLOURS}, {rows}, "
            f"{columns}] (colours, rows, columns); export it so, with any rows and columns or with these"
        )
    return size


def outputs_of_floats(outputs: Sequence[TensorSpec], file: Path) -> list[str]:
    """The names of a network's outputs that may be maps; others are left out.

    Raises:
        InvalidConfig: there is none.
    """
    floats = [one.name for one in outputs if one.kind in FLOATS and one.shape != ()]
    others = ", ".join(one.words for one in outputs if one.name not in floats)
    if not floats:
        raise InvalidConfig(f"perception.network: {file} gives {others or 'nothing'}, and maps are of float32")
    if others:
        _logger.info("%s gives %s as well, which is left out", file.name, others)
    return floats


def as_float32(values: NDArray[np.floating]) -> Float32Array:
    """The same array where it is of float32, else a copy that is."""
    return values.astype(np.float32, copy=False)


@contextmanager
def explained(library: str, file: Path, size: Size) -> Generator[None]:
    """Explain in one sentence why a library can't use a file; such exceptions have no common base class.

    Raises:
        InvalidConfig: the library can't use the file on images of this size.
    """
    try:
        yield
    except InvalidConfig:
        raise
    except Exception as error:
        rows, columns = size
        reason = str(error).strip().splitlines()
        raise InvalidConfig(
            f"perception.network: {library} can't use {file} on images of {rows}×{columns}: "
            f"{reason[-1] if reason else type(error).__name__}"
        ) from error


def _own_size(shape: tuple[int | None, ...] | None, default: Size) -> Size:
    """Rows and columns that a network is made for, the default's where it takes several, or no image as ours."""
    if shape is None or len(shape) != 4:
        return default
    _, colours, rows, columns = shape
    # Where the last side is that of the colours, it must not be taken for the columns: the network would run.
    if colours != COLOURS and (colours is not None or columns == COLOURS):
        return default
    return rows or default[0], columns or default[1]


def _takes(shape: tuple[int | None, ...] | None, given: tuple[int, ...]) -> bool:
    if shape is None:
        return True
    return len(shape) == len(given) and all(own in (None, side) for own, side in zip(shape, given, strict=True))
