"""The result of a measuring process for its parent: a line of JSON, and arrays in a file."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from benchmarks.accelerator.differences import digest


class Measured(Struct, frozen=True, kw_only=True):
    """One process's findings.

    Attributes:
        device: what computed, in its driver's or library's words.
        on_gpu: whether that is a GPU.
        seconds: of each repetition, by stage.
        digests: of the bytes that came out, by what they are.
    """

    device: str
    on_gpu: bool
    seconds: dict[str, list[float]]
    digests: dict[str, str]


def hand_over(found: Measured) -> None:
    """Print it for the process that waits for it."""
    print(msgspec.json.encode(found).decode())  # noqa: T201 (a program reads it)


def save_arrays(file: Path, arrays: Mapping[str, NDArray[Any]]) -> dict[str, str]:
    """Keep arrays for comparison; returns the digest of each."""
    named: dict[str, Any] = dict(arrays)
    np.savez(file, **named)
    return {name: digest({name: array}) for name, array in arrays.items()}


def load_arrays(file: Path) -> dict[str, NDArray[Any]]:
    """The arrays that `save_arrays` wrote."""
    with np.load(file) as stored:
        return {name: stored[name] for name in stored.files}


def options_of(arguments: Sequence[str] | None, description: str | None) -> argparse.Namespace:
    """Of a measuring process's command line."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arrays", type=Path, required=True, help="where to keep what came out")
    parser.add_argument("--count", type=int, default=60, help="frames or gradient updates")
    parser.add_argument("--frames", type=Path, help="of `render`, to perceive")
    parser.add_argument("--device", default="cpu", help="engine to infer on, or torch's device to learn on")
    return parser.parse_args(arguments)
