"""Where episodes begin: functions of their seeds, computed for many at once.

A generator for each episode would take longer than all of its steps. So numbers are mixed as SplitMix64 does
(Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014).
"""

import numpy as np
from numpy.typing import NDArray

from agent.environment.episode_seeds import SEED_LIMIT
from protocol.grid.table import CELLS, CENTRE

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)

_SEEDS, _PLACES, _CELLS = np.uint64(1), np.uint64(2), np.uint64(3)
"""Separate the random streams."""


def episode_seeds(run_seed: int, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) the seeds of a run's episodes, by their numbers from 0 in the order in which they begin."""
    run = _mixed(np.array([run_seed], np.uint64), _SEEDS)
    return (_mixed(run ^ numbers.astype(np.uint64), _SEEDS) % np.uint64(SEED_LIMIT)).astype(np.int64)


def starts(seeds: NDArray[np.int64], places: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(n,) the environment, of so many, and the cell in which the episode of each seed begins: any but the centre."""
    numbers = seeds.astype(np.uint64)
    place = (_mixed(numbers, _PLACES) % np.uint64(places)).astype(np.intp)
    cell = (_mixed(numbers, _CELLS) % np.uint64(CELLS - 1)).astype(np.intp)
    return place, cell + (cell >= CENTRE)


def _mixed(numbers: NDArray[np.uint64], stream: np.uint64) -> NDArray[np.uint64]:
    # Arrays of unsigned integers wrap around without a warning.
    mixed = (numbers + np.array([stream])) * _GAMMA
    mixed = (mixed ^ (mixed >> np.uint64(30))) * _FIRST
    mixed = (mixed ^ (mixed >> np.uint64(27))) * _SECOND
    return mixed ^ (mixed >> np.uint64(31))
