"""The seeds of episodes: functions of the run's seed and of the episode's number alone."""

import operator
from collections.abc import Iterable
from typing import SupportsIndex, TypeAlias

import numpy as np

from protocol.errors import InvalidInput

SEED_LIMIT = 2**31
"""Drawn seeds are below it."""

_LARGEST = 2**63 - 1
"""The largest seed of a scene on its way to a render worker, and in a checkpoint."""

GivenSeed: TypeAlias = SupportsIndex | Iterable[SupportsIndex | None] | None
"""Seeds as Gymnasium's vector environments take them: one, a sequence with one or None for each, or None."""


def episode_seed(run_seed: int, number: int) -> int:
    """The seed of a run's episode `number`, counted from 0 in the order in which episodes begin."""
    return int(np.random.SeedSequence((run_seed, number)).generate_state(1)[0]) % SEED_LIMIT


def drawn_seed(rng: np.random.Generator) -> int:
    """A drawn seed, where none was given."""
    return int(rng.integers(SEED_LIMIT))


def require_seed(seed: object) -> int:
    """A given seed, as Python's int.

    Raises:
        InvalidInput: it is not a whole number from 0 to 2⁶³ - 1.
    """
    try:
        number = operator.index(seed)  # type: ignore[arg-type]
    except TypeError:
        raise InvalidInput(f"a seed is a whole number, not {seed!r}") from None
    if not 0 <= number <= _LARGEST:
        raise InvalidInput(f"a seed is from 0 to {_LARGEST}, not {number}")
    return number


def require_seeds(seed: GivenSeed, drones: int) -> int | list[int | None] | None:
    """The seed given for several drones: a run's seed, or for each drone its episode's or None.

    Raises:
        InvalidInput: a seed is invalid, or their number is not that of the drones.
    """
    if seed is None:
        return None
    if isinstance(seed, str | bytes) or not isinstance(seed, Iterable):
        return require_seed(seed)
    seeds = [None if one is None else require_seed(one) for one in seed]
    if len(seeds) != drones:
        raise InvalidInput(f"{len(seeds)} seeds were given for {drones} drones")
    return seeds
