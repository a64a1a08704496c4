"""The cells of the grid, and the moves between them (thesis, sections 4.3.3 and 4.3.4).

The thesis leaves open what happens at the border. Here a move that would leave the grid is cut at the border along that
axis: the drone slides along it, or stays where it is.
"""

import numpy as np
from numpy.typing import NDArray

from protocol.arrays import Float32Array
from protocol.grid.table import CELLS, SIDE

MOVES: NDArray[np.intp] = np.array([(-1, 1), (0, 1), (1, 1), (-1, 0), (1, 0), (-1, -1), (0, -1), (1, -1)])
"""(8, 2) metres along the grid's x and y axes, by action."""

MOVE_NAMES = ("north-west", "north", "north-east", "west", "east", "south-west", "south", "south-east")
"""The actions in words; x points east and y north."""

ACTIONS = len(MOVES)


def _positions() -> NDArray[np.intp]:
    cells = np.arange(CELLS)
    return np.stack([cells % SIDE - SIDE // 2, cells // SIDE - SIDE // 2], axis=1)


def _destinations() -> NDArray[np.intp]:
    moved = np.clip(_positions()[:, None] + MOVES, -(SIDE // 2), SIDE // 2) + SIDE // 2
    return moved[:, :, 0] + SIDE * moved[:, :, 1]


POSITIONS: Float32Array = _positions().astype(np.float32)
"""(361, 2) x and y of each cell, in metres from the person."""

DESTINATIONS: NDArray[np.intp] = _destinations()
"""(361, 8) the cell in which a move from a cell ends."""
