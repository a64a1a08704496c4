"""The eight symmetries of the grid: quarter turns, and the same in a mirror.

An environment that is turned about the person is one whose person faces another way; in a mirror, their left and right
joints change places as well, which the upper body's weights don't notice. So each environment gives eight to train on.
"""

import math
from itertools import product

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from agent.environment.grid.cells import POSITIONS
from agent.environment.grid.grid_map import GridMap
from protocol.arrays import Float32Array
from protocol.grid.table import SIDE, GridPlace, GridTable
from protocol.grid_config import GridConfig
from protocol.scene import Split
from protocol.skeleton import MIRRORED


class Symmetry(Struct, frozen=True):
    """A mirror image across the x axis, if `mirrored`, and then so many quarter turns counter-clockwise."""

    quarters: int
    mirrored: bool

    @property
    def sources(self) -> NDArray[np.intp]:
        """(361,) the cell from which each cell takes its view."""
        x, y = POSITIONS.T.astype(np.intp)
        for _ in range(self.quarters):
            x, y = y, -x
        y = -y if self.mirrored else y
        return x + SIDE // 2 + SIDE * (y + SIDE // 2)

    def place(self, place: GridPlace) -> GridPlace:
        """The environment with the way that its person faces now."""
        yaw = (-place.yaw if self.mirrored else place.yaw) + self.quarters * math.pi / 2
        return replace(place, yaw=math.remainder(yaw, 2 * math.pi))

    def observations(self, observations: Float32Array) -> Float32Array:
        """(n, 361, 20) what is seen from each cell."""
        seen = observations[:, self.sources]
        if self.mirrored:
            seen[:, :, 2:] = seen[:, :, 2:][:, :, MIRRORED]
        seen[:, :, :2] = POSITIONS
        return seen


SYMMETRIES = tuple(Symmetry(quarters, mirrored) for mirrored, quarters in product((False, True), range(4)))
"""All eight; the first leaves everything as it is."""


def walked_map(table: GridTable, config: GridConfig, split: Split) -> GridMap:
    """The map that an environment walks on; in `train`, by all symmetries if the configuration says so."""
    grid_map = GridMap.of_table(table, split, config.observation)
    return with_symmetries(grid_map) if split == "train" and config.symmetries else grid_map


def with_symmetries(grid_map: GridMap) -> GridMap:
    """A map's environments by each symmetry in turn, eight times as many."""
    return GridMap(
        places=tuple(symmetry.place(place) for symmetry in SYMMETRIES for place in grid_map.places),
        observations=np.concatenate([symmetry.observations(grid_map.observations) for symmetry in SYMMETRIES]),
        uncertainty=np.concatenate([grid_map.uncertainty[:, symmetry.sources] for symmetry in SYMMETRIES]),
    )
