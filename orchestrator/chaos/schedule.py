"""Which fault strikes when: a pure function of the seed, so that a rehearsal can be done again."""

import math
import random
from collections.abc import Sequence

from msgspec import Struct

from protocol.errors import InvalidInput

FIRST, LAST = 0.03, 0.90
"""Shares of a run between which faults strike; what the last ones undo still has to be flown again."""
STRIKE, CHECKPOINT = 0.25, 0.5
"""Shares of the stretch of a run that a fault has to itself: it strikes within the first, and there is a checkpoint
after no more than the second. What is left is for the recovery."""
RECOVERY = 2
"""Steps of every drone that a training has for going beyond where it was struck, if it needs all others before."""
SHORTEST = 20
"""Steps of every drone in a stretch. A quarter of it has to be `RECOVERY` and three that are lost to rounding."""


class PlannedFault(Struct, frozen=True, kw_only=True):
    """One fault to come; steps are environment steps of all drones, prefill included.

    Attributes:
        step: at which it strikes: the training waits there until it is about to.
        fault_until: beyond which the training does not go while the fault happens. A checkpoint comes before.
        recovery_until: beyond which it does not go before it has recovered.
        chance: in [0, 1), for what the scenario leaves open, such as which of several workers it is.
    """

    scenario: str
    step: int
    fault_until: int
    recovery_until: int
    chance: float


def plan(seed: int, faults: int, scenarios: Sequence[str], steps: int, *, drones: int) -> tuple[PlannedFault, ...]:
    """So many faults over a run of so many steps, in the order in which they strike.

    Every scenario has its turn before any has a second one, and each fault a stretch of the run to itself.

    Raises:
        InvalidInput: the run is too short for so many.
    """
    most = int((LAST - FIRST) * steps / (SHORTEST * drones))
    if faults > most:
        raise InvalidInput(
            f"a training of {steps} steps, prefill included, has room for at most {most} faults, not for {faults}; "
            f"ask for fewer, or train longer"
        )
    rng = random.Random(seed)
    names = _in_rounds(rng, faults, scenarios)
    begin, stretch = FIRST * steps, _stretch(faults, steps)
    return tuple(_planned(rng, name, begin + number * stretch, stretch, drones) for number, name in enumerate(names))


def steps_to_a_checkpoint(faults: int, steps: int) -> int:
    """The most steps between two checkpoints with which one comes in the stretch of every fault."""
    return int(CHECKPOINT * _stretch(faults, steps))


def strike_times(seed: int, mean: float, seconds: float) -> tuple[float, ...]:
    """Moments, in seconds from the beginning, of faults that strike at random and at this rate, up to `seconds`."""
    rng = random.Random(seed)
    moments: list[float] = []
    moment = rng.expovariate(1 / mean)
    while moment < seconds:
        moments.append(moment)
        moment += rng.expovariate(1 / mean)
    return tuple(moments)


def _stretch(faults: int, steps: int) -> float:
    """Steps of a run that each fault has to itself."""
    return (LAST - FIRST) * steps / max(faults, 1)


def _planned(rng: random.Random, scenario: str, begin: float, stretch: float, drones: int) -> PlannedFault:
    """A fault in a stretch of a run; a training can wait where all its drones have flown the same steps."""
    end = math.floor((begin + stretch) / drones)
    return PlannedFault(
        scenario=scenario,
        step=math.ceil((begin + rng.random() * STRIKE * stretch) / drones) * drones,
        fault_until=(end - RECOVERY) * drones,
        recovery_until=end * drones,
        chance=rng.random(),
    )


def _in_rounds(rng: random.Random, faults: int, scenarios: Sequence[str]) -> list[str]:
    names: list[str] = []
    while len(names) < faults:
        names += rng.sample(scenarios, min(len(scenarios), faults - len(names)))
    return names
