"""What came of episodes on the grid: rates, lengths beside the shortest, and how the others failed."""

import math

import numpy as np
from numpy.typing import NDArray

from agent.environment.grid.cells import POSITIONS
from agent.environment.grid.grid_map import GridMap
from agent.grid_episodes import GridEpisodes
from agent.intervals import mean_interval
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.grid.paths import shortest_paths
from protocol.grid.records import FailureMode, GridScore
from protocol.records import Interval, PolicyScore

_TAIL = 50
"""Last steps of an episode that was truncated, by which its failure is told."""

_FEW_CELLS = 6
"""Cells in that many steps below which a drone goes to and fro."""


def score(policy: str, episodes: GridEpisodes, grid_map: GridMap, threshold: float) -> GridScore:
    """The score of a policy's episodes, of one or more environments each."""
    solvable = _solvable(grid_map, threshold)[episodes.place]
    won = episodes.succeeded
    shortest = shortest_paths(grid_map.uncertainty < threshold)[episodes.place, episodes.start]
    lengths = episodes.length.astype(np.float64)
    return GridScore(
        policy=policy,
        threshold=threshold,
        episodes=len(lengths),
        success=_over_environments(won, episodes.place),
        success_of_solvable=_over_environments(won[solvable], episodes.place[solvable]),
        crash=_over_environments(episodes.crashed, episodes.place),
        length=_over_environments(lengths, episodes.place),
        length_deviation=float(lengths.std()),
        success_length=_over_environments(lengths[won], episodes.place[won]) if won.any() else None,
        ratio=float(lengths[won].mean() / shortest[won].mean()) if won.any() else None,
        total_reward=_over_environments(episodes.total_reward, episodes.place),
        uncertainty=_over_environments(grid_map.uncertainty[episodes.place, episodes.end], episodes.place),
        failures=failures(episodes, grid_map, threshold),
    )


def policy_score(score: GridScore) -> PolicyScore:
    """A policy's row in the table of a run's evaluation."""
    return PolicyScore(
        policy=score.policy,
        episodes=score.episodes,
        total_reward=score.total_reward,
        uncertainty=score.uncertainty,
        success=score.success,
        crash=score.crash,
        length=score.length,
    )


def failures(episodes: GridEpisodes, grid_map: GridMap, threshold: float) -> dict[FailureMode, int]:
    """The number of episodes that did not succeed, by how (thesis, section 4.6.2).

    An episode that was truncated though its environment has a cell that succeeds counts by its last 50 steps: it
    oscillated between a few cells, circled once around the person or more, or wandered.
    """
    solvable = _solvable(grid_map, threshold)[episodes.place]
    truncated = ~(episodes.succeeded | episodes.crashed)
    lost = np.flatnonzero(truncated & solvable)
    oscillating, circling = _oscillating(episodes.path[lost]), _turns(episodes.path[lost]) >= 1.0
    return {
        "crash": int(episodes.crashed.sum()),
        "righteous": int((truncated & ~solvable).sum()),
        "oscillating": int(oscillating.sum()),
        "circling": int((circling & ~oscillating).sum()),
        "wandering": int((~circling & ~oscillating).sum()),
    }


def _solvable(grid_map: GridMap, threshold: float) -> BoolArray:
    best: Float32Array = grid_map.uncertainty.min(axis=1)
    return best < threshold


def _oscillating(path: NDArray[np.int16]) -> BoolArray:
    tails = np.sort(path[:, -_TAIL:], axis=1)
    changes: NDArray[np.intp] = (np.diff(tails, axis=1) != 0).sum(axis=1)
    return changes + 1 <= _FEW_CELLS


def _turns(path: NDArray[np.int16]) -> Float64Array:
    """(n,) turns around the person in the last steps, whichever way."""
    positions = POSITIONS[path[:, -_TAIL:]].astype(np.float64)
    bearing = np.unwrap(np.arctan2(positions[:, :, 1], positions[:, :, 0]), axis=1)
    return np.abs(bearing[:, -1] - bearing[:, 0]) / (2.0 * math.pi)


def _over_environments(values: Float64Array | Float32Array | BoolArray, place: NDArray[np.intp]) -> Interval:
    """The mean of all values; its interval is that of the mean over environments."""
    if not len(values):
        return Interval(mean=math.nan, low=math.nan, high=math.nan)
    each = [float(np.mean(values[place == number])) for number in np.unique(place)]
    interval = mean_interval(each)
    return Interval(mean=float(np.mean(values)), low=interval.low, high=interval.high)
