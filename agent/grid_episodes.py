"""Whole episodes on the grid: many walked at once by one policy, and what came of each."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.walks import Walks, take_step
from agent.learning.grid_policies import GridPolicy
from protocol.arrays import BoolArray, Float64Array
from protocol.artifact import whole_file
from protocol.grid.table import CELLS, CENTRE
from protocol.grid_config import GridReward

_NOWHERE = -1


class GridEpisodes(Struct, frozen=True, eq=False, kw_only=True):
    """Finished episodes, n of them.

    Attributes:
        place: (n,) the environment's number in the map.
        path: (n, steps + 1) the cells from the start on; -1 after the end.
        length: (n,) steps.
        total_reward: (n,).
        succeeded, crashed: (n,) how it ended; the others were truncated.
    """

    place: NDArray[np.intp]
    path: NDArray[np.int16]
    length: NDArray[np.int64]
    total_reward: Float64Array
    succeeded: BoolArray
    crashed: BoolArray

    @property
    def start(self) -> NDArray[np.intp]:
        """(n,) the cells in which they began."""
        return self.path[:, 0].astype(np.intp)

    @property
    def end(self) -> NDArray[np.intp]:
        """(n,) the cells in which they ended."""
        return self.path[np.arange(len(self.path)), self.length].astype(np.intp)


def write_walks(path: Path, episodes: GridEpisodes, threshold: float) -> None:
    """Write where episodes went to a file; arrays alone, so nothing in it executes."""
    with whole_file(path) as aside, aside.open("wb") as file:
        np.savez_compressed(file, threshold=threshold, place=episodes.place, path=episodes.path)


def every_start(grid_map: GridMap) -> Walks:
    """The episodes of every environment from every cell but the person's."""
    cells = np.delete(np.arange(CELLS), CENTRE)
    places = len(grid_map.places)
    return Walks.begin_at(np.repeat(np.arange(places), len(cells)), np.tile(cells, places))


def walk_episodes(
    policy: GridPolicy,
    begun: Walks,
    grid_map: GridMap,
    *,
    threshold: float,
    reward: GridReward,
    episode_steps: int,
    on_step: Callable[[int], None] = lambda _steps: None,
) -> GridEpisodes:
    """Walk episodes to their ends.

    Args:
        on_step: called with the number of steps of each round; may raise to stop.
    """
    count = len(begun.cell)
    path = np.full((count, episode_steps + 1), _NOWHERE, np.int16)
    path[:, 0] = begun.cell
    rewards = np.zeros(count)
    succeeded, crashed = np.zeros(count, bool), np.zeros(count, bool)
    length = np.zeros(count, np.int64)
    walks, drones = begun, np.arange(count)
    policy.begin(walks)
    while len(drones):
        step = take_step(
            walks, policy.act(walks), grid_map, threshold=threshold, reward=reward, episode_steps=episode_steps
        )
        length[drones] += 1
        path[drones, length[drones]] = step.walks.cell
        rewards[drones] = step.walks.total_reward
        succeeded[drones], crashed[drones] = step.succeeded, step.crashed
        on_step(len(drones))
        going = np.flatnonzero(~step.over)
        policy.keep(going)
        walks, drones = step.walks.of(going), drones[going]
    return GridEpisodes(
        place=begun.place, path=path, length=length, total_reward=rewards, succeeded=succeeded, crashed=crashed
    )
