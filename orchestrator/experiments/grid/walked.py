"""The walks of an evaluation, as the agent wrote them."""

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from protocol.arrays import Float64Array
from protocol.errors import DamagedRecord
from protocol.grid.table import SIDE


class Walked(Struct, frozen=True, eq=False):
    """The episodes of a run's policy at its own threshold, from every start in every test environment.

    Attributes:
        place: (n,) the environment's number in its split.
        path: (n, steps + 1) the cells from the start on; -1 after the end.
    """

    threshold: float
    place: NDArray[np.integer]
    path: NDArray[np.int16]

    @classmethod
    def read(cls, path: Path) -> Self:
        """The walks in a file.

        Raises:
            DamagedRecord: it is missing or damaged.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                return cls(float(file["threshold"]), file["place"], file["path"])
        except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise DamagedRecord(f"{path} holds no walks: {error}; evaluate the run again") from error

    def some_paths(self, place: int, count: int) -> list[Float64Array]:
        """Positions (k, 2) in metres along so many walks in an environment, from starts far apart."""
        own = self.path[self.place == place]
        chosen = own[np.linspace(0, len(own) - 1, count).astype(int)]
        return [positions_of(path[path >= 0].tolist()) for path in chosen]

    def cells_of(self, episode: int) -> tuple[int, ...]:
        """The cells of an episode, from its start to its end."""
        path = self.path[episode]
        return tuple(path[path >= 0].tolist())


def positions_of(cells: Sequence[int]) -> Float64Array:
    """(k, 2) the positions of cells, metres from the person."""
    numbers = np.asarray(cells, float)
    return np.stack([numbers % SIDE - SIDE // 2, numbers // SIDE - SIDE // 2], axis=1)
