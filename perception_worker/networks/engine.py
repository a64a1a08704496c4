"""An engine runs a network's file on this machine: arrays in, arrays out."""

from collections.abc import Mapping
from typing import Protocol, TypeAlias

from protocol.arrays import Float32Array

Outputs: TypeAlias = Mapping[str, Float32Array]
Shapes: TypeAlias = Mapping[str, tuple[int, ...]]


class Engine(Protocol):
    """May be called by several threads at once."""

    @property
    def input_size(self) -> tuple[int, int]:
        """Rows and columns of its input."""
        ...

    @property
    def outputs(self) -> Shapes:
        """Shapes of its outputs, by name and without the batch's dimension."""
        ...

    def run(self, image: Float32Array) -> Outputs:
        """The network's outputs for an image (3, rows, columns), by name and without the batch's dimension."""
        ...


def shapes_of(outputs: Outputs) -> dict[str, tuple[int, ...]]:
    """The shapes of arrays by name."""
    return {name: values.shape for name, values in outputs.items()}
