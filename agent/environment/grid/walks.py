"""The rules of the grid, for many drones at once (thesis, sections 4.3.4, 4.3.5 and 4.5).

A step that ends in the person's cell is a crash, one that ends where the weighted uncertainty is below the threshold a
success. What the thesis leaves open is decided so: success is checked after a step, so an episode that begins in such a
cell takes one step or more; of the third reward, the thesis's "QoE value" is minus a fortieth of the weighted
uncertainty: a positive value would reward drones that do not succeed, and with a larger one a crash would cost less
than a walk in an environment where no cell succeeds.
"""

from typing import Any, Self

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from agent.environment.grid.cells import DESTINATIONS, POSITIONS
from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.starts import starts
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.grid.table import CENTRE
from protocol.grid_config import GridReward
from protocol.records import Outcome


class Walks(Struct, frozen=True, eq=False, kw_only=True):
    """Where n drones are in their episodes.

    Attributes:
        seeds: (n,) of the episodes.
        place: (n,) the environment's number in the map.
        cell: (n,).
        steps: (n,) so far.
        total_reward: (n,) so far.
    """

    seeds: NDArray[np.int64]
    place: NDArray[np.intp]
    cell: NDArray[np.intp]
    steps: NDArray[np.int64]
    total_reward: Float64Array

    @classmethod
    def begin(cls, seeds: NDArray[np.int64], grid_map: GridMap) -> Self:
        """The episodes of these seeds, before their first steps."""
        place, cell = starts(seeds, len(grid_map.places))
        return cls.begin_at(place, cell, seeds)

    @classmethod
    def begin_at(cls, place: NDArray[np.intp], cell: NDArray[np.intp], seeds: NDArray[np.int64] | None = None) -> Self:
        """Episodes that begin in these environments and cells."""
        numbers = np.zeros(len(cell), np.int64) if seeds is None else seeds
        return cls(
            seeds=numbers,
            place=place,
            cell=cell,
            steps=np.zeros(len(cell), np.int64),
            total_reward=np.zeros(len(cell)),
        )

    def observations(self, grid_map: GridMap) -> Float32Array:
        """(n, 20) what the drones see."""
        return grid_map.observations[self.place, self.cell]

    def uncertainty(self, grid_map: GridMap) -> Float32Array:
        """(n,) weighted, 0 to 10."""
        return grid_map.uncertainty[self.place, self.cell]

    def positions(self) -> Float32Array:
        """(n, 2) metres from the person."""
        return POSITIONS[self.cell]

    def with_begun(self, drones: NDArray[np.intp], others: "Walks") -> Self:
        """The walks with those of some drones replaced, in their order."""
        changed = {name: getattr(self, name).copy() for name in self.__struct_fields__}
        for name, values in changed.items():
            values[drones] = getattr(others, name)
        return replace(self, **changed)

    def of(self, drones: NDArray[np.intp]) -> Self:
        """The walks of some drones."""
        return type(self)(**{name: values[drones] for name, values in self.state().items()})

    def state(self) -> dict[str, Any]:
        """All of it as arrays by name."""
        return {name: getattr(self, name) for name in self.__struct_fields__}


class GridStep(Struct, frozen=True, eq=False, kw_only=True):
    """What came of a step of n drones: their walks after it, and (n,) arrays."""

    walks: Walks
    rewards: Float64Array
    succeeded: BoolArray
    crashed: BoolArray
    truncated: BoolArray

    @property
    def terminated(self) -> BoolArray:
        """(n,) whether the episode ended by itself."""
        return self.succeeded | self.crashed

    @property
    def over(self) -> BoolArray:
        """(n,) whether the episode ended."""
        return self.terminated | self.truncated


def take_step(
    walks: Walks,
    actions: NDArray[np.integer[Any]],
    grid_map: GridMap,
    *,
    threshold: float,
    reward: GridReward,
    episode_steps: int,
) -> GridStep:
    """Every drone's walk after a step.

    Args:
        actions: (n,) from 0 to 7.
        threshold: weighted uncertainty below which an episode succeeds.
        reward: which of the thesis's three; see `GridConfig.reward`.
        episode_steps: after which an episode is truncated.
    """
    cell = DESTINATIONS[walks.cell, actions]
    uncertainty = grid_map.uncertainty[walks.place, cell]
    crashed = cell == CENTRE
    succeeded = (uncertainty < threshold) & ~crashed
    steps = walks.steps + 1
    rewards = _rewards(reward, uncertainty, succeeded, crashed)
    return GridStep(
        walks=replace(walks, cell=cell, steps=steps, total_reward=walks.total_reward + rewards),
        rewards=rewards,
        succeeded=succeeded,
        crashed=crashed,
        truncated=(steps >= episode_steps) & ~(succeeded | crashed),
    )


def outcomes(step: GridStep) -> NDArray[np.object_]:
    """(n,) the outcome of each drone's episode so far, in the words of the records."""
    words: list[Outcome] = ["flying", "truncated", "too_close", "succeeded"]
    return np.array(words, object)[step.truncated + 2 * step.crashed + 3 * step.succeeded]


def _rewards(reward: GridReward, uncertainty: Float32Array, succeeded: BoolArray, crashed: BoolArray) -> Float64Array:
    """(n,). Source: thesis, sections 4.5.1 to 4.5.3."""
    ends = succeeded.astype(np.float64) - crashed
    goes_on = ~(succeeded | crashed)
    if reward == "binary":
        return ends
    if reward == "path_length":
        return ends - 0.1 * goes_on
    return 10.0 * ends - goes_on * uncertainty.astype(np.float64) / 40.0
