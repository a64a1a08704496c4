"""The shortest paths on the grid, around the person: what a policy could reach that knows every view."""

import numpy as np

from protocol.arrays import BoolArray, Float64Array
from protocol.grid.table import CELLS, CENTRE, SIDE

_STEPS = tuple((row, column) for row in (0, 1, 2) for column in (0, 1, 2) if (row, column) != (1, 1))
"""The eight moves, as offsets into an array with a margin of one cell on each side."""


def shortest_paths(success: BoolArray) -> Float64Array:
    """The number of moves from each cell to any successful one, by breadth-first search.

    A move leads to one of the eight cells around that is on the grid and is not the centre. There is at least one move,
    since success is checked after each: from a successful cell it leads to a successful neighbour, or away and back, or
    at the border against it, where the drone stays.

    Args:
        success: (n, 361) whether an episode succeeds in a cell; the centre does not count.

    Returns:
        (n, 361), infinite where no successful cell can be reached, and in the centre.
    """
    open_cells = np.ones(CELLS, bool)
    open_cells[CENTRE] = False
    reached = success & open_cells
    moves = np.where(reached, 0.0, np.inf)
    frontier, count = reached, 0
    while frontier.any():
        count += 1
        frontier = _beside(frontier) & open_cells & ~reached
        reached = reached | frontier
        moves[frontier] = count
    again = np.where(_beside(success & open_cells) | _at_border(), 1.0, 2.0)
    return np.where(success & open_cells, again, moves)


def _at_border() -> BoolArray:
    """(361,) the cells from which a move over the border leads back to themselves."""
    border = np.ones((SIDE, SIDE), bool)
    border[1:-1, 1:-1] = False
    return border.ravel()


def _beside(cells: BoolArray) -> BoolArray:
    """(n, 361) the cells that one move leads to from any of the given ones, or leaves for them."""
    framed = np.pad(cells.reshape(-1, SIDE, SIDE), ((0, 0), (1, 1), (1, 1)))
    around = [framed[:, row : row + SIDE, column : column + SIDE] for row, column in _STEPS]
    return np.logical_or.reduce(around).reshape(-1, CELLS)
