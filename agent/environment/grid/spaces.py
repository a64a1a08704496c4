"""Gymnasium's spaces of the grid."""

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import ArrayLike, NDArray

from agent.environment.grid.cells import ACTIONS
from agent.environment.grid.grid_map import OBSERVATION_SIZE
from protocol.errors import InvalidInput
from protocol.grid.table import SIDE

_HALF = SIDE // 2


def observation_space() -> Box[np.float32]:
    """Observations (20,): x and y in metres from the person, and the certainty of each joint. Source: thesis, 4.3.5."""
    lowest, highest = np.zeros(OBSERVATION_SIZE, np.float32), np.ones(OBSERVATION_SIZE, np.float32)
    lowest[:2], highest[:2] = -_HALF, _HALF
    return Box(lowest, highest, dtype=np.float32)


def action_space() -> Discrete:
    """The eight neighbouring cells; see `MOVES`."""
    return Discrete(ACTIONS)


def require_moves(actions: ArrayLike, count: int) -> NDArray[np.intp]:
    """Return `actions` as (count,) whole numbers from 0 to 7.

    Raises:
        InvalidInput: they are not.
    """
    moves = np.asarray(actions)
    if moves.shape != (count,) or moves.dtype.kind not in "iu":
        raise InvalidInput(f"actions are {count} whole numbers, not {moves.dtype} of the shape {moves.shape}")
    if moves.size and not (moves.min() >= 0 and moves.max() < ACTIONS):
        raise InvalidInput(f"an action is from 0 to {ACTIONS - 1}, not {moves.min()} or {moves.max()}")
    return moves.astype(np.intp)
