"""Which fault strikes when: a pure function of the seed, so that a rehearsal can be done again."""

import random
from collections.abc import Sequence

from msgspec import Struct

FIRST, LAST = 0.03, 0.90
"""Shares of a run between which faults strike; what the last ones undo still has to be flown again."""


class PlannedFault(Struct, frozen=True, kw_only=True):
    """One fault to come.

    Attributes:
        step: environment steps of all drones, prefill included, before which it does not strike.
        chance: in [0, 1), for what the scenario leaves open, such as which of several workers it is.
    """

    scenario: str
    step: int
    chance: float


def plan(seed: int, faults: int, scenarios: Sequence[str], steps: int) -> tuple[PlannedFault, ...]:
    """So many faults over a run of so many steps, in the order in which they strike.

    Every scenario has its turn before any has a second one, and each fault a stretch of the run to itself.
    """
    rng = random.Random(seed)
    names = _in_rounds(rng, faults, scenarios)
    stretch = (LAST - FIRST) * steps / max(faults, 1)
    return tuple(
        PlannedFault(scenario=name, step=int(FIRST * steps + (number + rng.random()) * stretch), chance=rng.random())
        for number, name in enumerate(names)
    )


def strike_times(seed: int, mean: float, seconds: float) -> tuple[float, ...]:
    """Moments, in seconds from the beginning, of faults that strike at random and at this rate, up to `seconds`."""
    rng = random.Random(seed)
    moments: list[float] = []
    moment = rng.expovariate(1 / mean)
    while moment < seconds:
        moments.append(moment)
        moment += rng.expovariate(1 / mean)
    return tuple(moments)


def _in_rounds(rng: random.Random, faults: int, scenarios: Sequence[str]) -> list[str]:
    names: list[str] = []
    while len(names) < faults:
        names += rng.sample(scenarios, min(len(scenarios), faults - len(names)))
    return names
