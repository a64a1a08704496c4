"""Policies of the grid that learn nothing: what a trained one is compared with."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from agent.environment.grid.cells import ACTIONS, DESTINATIONS, MOVES, POSITIONS
from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.walks import Walks
from protocol.arrays import Float64Array
from protocol.grid.paths import shortest_paths
from protocol.grid.table import CENTRE

CIRCLE_RADIUS = 3.0
"""Metres from the person, at which views from the front succeed most often."""

_Cells = NDArray[np.intp]


class GridPolicy(Protocol):
    """Chooses the moves of many drones at once, each by what it has seen in its own episode."""

    def begin(self, walks: Walks) -> None:
        """Forget all episodes; these begin."""
        ...

    def act(self, walks: Walks) -> _Cells:
        """(n,) actions from 0 to 7."""
        ...

    def keep(self, drones: _Cells) -> None:
        """Go on with some of the drones alone; the episodes of the others are over."""
        ...


class RandomWalk:
    """Any move."""

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed
        self._random = np.random.default_rng(seed)

    def begin(self, walks: Walks) -> None:
        """Draw anew."""
        self._random = np.random.default_rng(self._seed)

    def act(self, walks: Walks) -> _Cells:
        """(n,) drawn evenly."""
        return self._random.integers(ACTIONS, size=len(walks.cell))

    def keep(self, drones: _Cells) -> None:
        """Nothing is remembered."""


class Circle:
    """To the circle around the person, and along it counter-clockwise. Source: thesis, section 4.1.1."""

    def begin(self, walks: Walks) -> None:
        """Nothing is remembered."""

    def act(self, walks: Walks) -> _Cells:
        """(n,) the moves that end nearest to a point a metre ahead on the circle."""
        x, y = walks.positions().T.astype(np.float64)
        ahead = np.arctan2(y, x) + 1.2 / CIRCLE_RADIUS
        goal = CIRCLE_RADIUS * np.stack([np.cos(ahead), np.sin(ahead)], axis=1)
        destinations = DESTINATIONS[walks.cell]
        off = np.linalg.norm(POSITIONS[destinations] - goal[:, None], axis=2)
        off[destinations == CENTRE] = np.inf
        return off.argmin(axis=1)

    def keep(self, drones: _Cells) -> None:
        """Nothing is remembered."""


class Greedy:
    """Goes on while the view gets better, and else turns to a direction drawn at random; keeps off the person.

    It knows the last view and this one, and no map.
    """

    def __init__(self, grid_map: GridMap, seed: int = 0) -> None:
        self._map = grid_map
        self._seed = seed

    def begin(self, walks: Walks) -> None:
        """Set out in any direction."""
        self._random = np.random.default_rng(self._seed)
        self._before = np.full(len(walks.cell), np.inf)
        self._last = self._random.integers(ACTIONS, size=len(walks.cell))

    def act(self, walks: Walks) -> _Cells:
        """(n,)."""
        now = walks.uncertainty(self._map).astype(np.float64)
        drawn = self._random.integers(ACTIONS, size=len(now))
        actions = np.where(now < self._before, self._last, drawn)
        # On the border, and beside the person, the move that would lead on is not there.
        blocked = _destinations(walks, actions)
        actions = np.where((blocked == walks.cell) | (blocked == CENTRE), _safe(walks, drawn), actions)
        self._before, self._last = now, actions
        return actions

    def keep(self, drones: _Cells) -> None:
        """Remember these alone."""
        self._before, self._last = self._before[drones], self._last[drones]


class ShortestPath:
    """To the nearest cell that succeeds, around the person; knows the map, as no drone does.

    Where no cell succeeds, it circles.
    """

    def __init__(self, grid_map: GridMap, threshold: float) -> None:
        self._moves: Float64Array = shortest_paths(grid_map.uncertainty < threshold)
        self._ends = np.where(grid_map.uncertainty < threshold, 0.0, self._moves)
        self._circle = Circle()

    def begin(self, walks: Walks) -> None:
        """Nothing is remembered."""

    def act(self, walks: Walks) -> _Cells:
        """(n,)."""
        destinations = DESTINATIONS[walks.cell]
        left = self._ends[walks.place[:, None], destinations]
        left[destinations == CENTRE] = np.inf
        known = np.isfinite(left.min(axis=1))
        return np.where(known, left.argmin(axis=1), self._circle.act(walks))

    def keep(self, drones: _Cells) -> None:
        """Nothing is remembered."""


GRID_BASELINES: dict[str, Callable[[GridMap, float], GridPolicy]] = {
    "random": lambda _map, _threshold: RandomWalk(),
    "circle": lambda _map, _threshold: Circle(),
    "greedy": lambda grid_map, _threshold: Greedy(grid_map),
    "optimum": ShortestPath,
}
"""The baselines by name, for a map and the threshold at which episodes succeed."""


def _destinations(walks: Walks, actions: _Cells) -> _Cells:
    return DESTINATIONS[walks.cell, actions]


def _safe(walks: Walks, actions: _Cells) -> _Cells:
    """The actions, turned by 45° as often as they lead to the person."""
    turned = actions
    for _ in range(ACTIONS):
        turned = np.where(_destinations(walks, turned) == CENTRE, _TURNED[turned], turned)
    return turned


def _turns() -> _Cells:
    """(8,) each action's neighbour counter-clockwise."""
    order = np.argsort(np.arctan2(MOVES[:, 1], MOVES[:, 0]))
    following = np.empty(ACTIONS, np.intp)
    following[order] = np.roll(order, -1)
    return following


_TURNED = _turns()
