"""Which seed an episode has: a function of the run's seed and of the episode's number, and of nothing else."""

import operator
from collections.abc import Iterable
from typing import SupportsIndex, TypeAlias

import numpy as np

from protocol.errors import InvalidInput

SEED_LIMIT = 2**31
"""Seeds that are drawn are below."""

_LARGEST = 2**63 - 1
"""What a scene's seed may be on its way to a render worker, and in a checkpoint."""

GivenSeed: TypeAlias = SupportsIndex | Iterable[SupportsIndex | None] | None
"""What Gymnasium's vector environments take for a seed: one, or one or none for each of them, or none at all."""


def episode_seed(run_seed: int, number: int) -> int:
    """The seed of a run's episode `number`, counted from 0 in the order in which episodes begin."""
    return int(np.random.SeedSequence((run_seed, number)).generate_state(1)[0]) % SEED_LIMIT


def drawn_seed(rng: np.random.Generator) -> int:
    """A seed for where none was given."""
    return int(rng.integers(SEED_LIMIT))


def require_seed(seed: object) -> int:
    """A seed that was given, as Python's whole number.

    Raises:
        InvalidInput: it is no whole number, or not from 0 to 2⁶³ - 1.
    """
    try:
        number = operator.index(seed)  # type: ignore[arg-type]
    except TypeError:
        raise InvalidInput(f"a seed is a whole number, not {seed!r}") from None
    if not 0 <= number <= _LARGEST:
        raise InvalidInput(f"a seed is from 0 to {_LARGEST}, not {number}")
    return number


def require_seeds(seed: GivenSeed, drones: int) -> int | list[int | None] | None:
    """What was given as seed for several drones: a run's seed, or for each drone its episode's, or none.

    Raises:
        InvalidInput: a seed is none, or there are more or fewer than drones.
    """
    if seed is None:
        return None
    if isinstance(seed, str | bytes) or not isinstance(seed, Iterable):
        return require_seed(seed)
    seeds = [None if one is None else require_seed(one) for one in seed]
    if len(seeds) != drones:
        raise InvalidInput(f"{len(seeds)} seeds were given for {drones} drones")
    return seeds
