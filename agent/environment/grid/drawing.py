"""A walk on the grid, drawn from above: as a picture and as text. x points to the right, y up."""

import itertools
import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from agent.environment.grid.cells import POSITIONS
from agent.environment.grid.grid_map import MOST_UNCERTAIN
from protocol.arrays import BoolArray, Float32Array
from protocol.grid.table import CENTRE, SIDE

_Scalar = TypeVar("_Scalar", bound=np.generic)

PIXELS = 24
"""The side of a cell in a picture."""

_COLOURS = np.array([(253, 231, 37), (94, 201, 98), (33, 145, 140), (59, 82, 139), (68, 1, 84)], np.float64)
"""Viridis from its bright end: bright where the person is seen with certainty. It stays readable without colour."""

_SUCCESS, _PATH, _DRONE, _PERSON = (255, 255, 255), (255, 140, 60), (214, 39, 40), (20, 20, 20)
_SHADES = " .:-=+*#%@"


class Scenery(Struct, frozen=True, eq=False, kw_only=True):
    """What a walk is drawn on.

    Attributes:
        uncertainty: (361,) weighted, 0 to 10.
        threshold: below which a cell is a success.
        yaw: radians from the x axis to where the person faces.
    """

    uncertainty: Float32Array
    threshold: float
    yaw: float


def draw(scenery: Scenery, path: Sequence[int]) -> NDArray[np.uint8]:
    """A picture (456, 456, 3) of the map, the cells that succeed in white frames, the person and the walk.

    Args:
        path: the cells from the start to the drone.
    """
    picture = _upright(_colours(scenery.uncertainty)).repeat(PIXELS, axis=0).repeat(PIXELS, axis=1)
    x, y = _pixel_positions()
    for cell in np.flatnonzero(scenery.uncertainty < scenery.threshold):
        offset = np.maximum(np.abs(x - POSITIONS[cell, 0]), np.abs(y - POSITIONS[cell, 1]))
        picture[(offset > 0.4) & (offset <= 0.5)] = _SUCCESS
    _draw_person(picture, x, y, scenery.yaw)
    for before, after in itertools.pairwise(path):
        picture[_near_segment(x, y, POSITIONS[before], POSITIONS[after], 0.09)] = _PATH
    if path:
        picture[np.hypot(x - POSITIONS[path[-1], 0], y - POSITIONS[path[-1], 1]) < 0.35] = _DRONE
    return picture


def drawn_as_text(scenery: Scenery, path: Sequence[int]) -> str:
    """Nineteen lines: darker where the person is seen worse, `!` where an episode succeeds.

    The walk is `o`, the drone `D`, the person `H`.
    """
    levels = np.minimum(scenery.uncertainty / MOST_UNCERTAIN * len(_SHADES), len(_SHADES) - 1).astype(int)
    letters = np.array(list(_SHADES))[levels]
    letters[scenery.uncertainty < scenery.threshold] = "!"
    letters[list(path)] = "o"
    letters[CENTRE] = "H"
    letters[list(path[-1:])] = "D"
    return "\n".join("".join(row) for row in _upright(letters))


def _draw_person(picture: NDArray[np.uint8], x: Float32Array, y: Float32Array, yaw: float) -> None:
    picture[np.hypot(x, y) < 0.4] = _PERSON
    ahead = np.array([math.cos(yaw), math.sin(yaw)], np.float32)
    picture[_near_segment(x, y, ahead * np.float32(0.4), ahead, 0.1)] = _PERSON


def _colours(uncertainty: Float32Array) -> NDArray[np.uint8]:
    """(361, 3)."""
    along = np.clip(uncertainty / MOST_UNCERTAIN, 0.0, 1.0) * (len(_COLOURS) - 1)
    steps = np.arange(len(_COLOURS))
    return np.stack([np.interp(along, steps, _COLOURS[:, channel]) for channel in range(3)], axis=1).astype(np.uint8)


def _upright(cells: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """(361, …) to (19, 19, …), with y up."""
    return cells.reshape(SIDE, SIDE, *cells.shape[1:])[::-1]


def _pixel_positions() -> tuple[Float32Array, Float32Array]:
    """(h, w) x and y of each pixel's centre, in metres from the person."""
    along = (np.arange(SIDE * PIXELS, dtype=np.float32) + 0.5) / PIXELS - SIDE / 2
    x, y = np.meshgrid(along, -along)
    return x.astype(np.float32), y.astype(np.float32)


def _near_segment(x: Float32Array, y: Float32Array, begin: Float32Array, end: Float32Array, width: float) -> BoolArray:
    way = end - begin
    length = float(way @ way)
    along = np.clip(((x - begin[0]) * way[0] + (y - begin[1]) * way[1]) / max(length, 1e-9), 0.0, 1.0)
    return np.hypot(x - begin[0] - along * way[0], y - begin[1] - along * way[1]) < width
