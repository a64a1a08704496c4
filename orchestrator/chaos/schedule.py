"""The schedule of faults: a pure function of the seed, so that a rehearsal can be repeated."""

import math
import random
from collections.abc import Sequence

from msgspec import Struct

from protocol.errors import InvalidInput

FIRST, LAST = 0.03, 0.90
"""Shares of a run between which faults happen; the run still has to repeat the steps that the last fault loses."""
STRIKE, CHECKPOINT = 0.25, 0.5
"""Shares of the interval of a run that each fault has: the fault happens within the first share, and a checkpoint comes
within the second. The rest is for the recovery."""
RECOVERY = 2
"""Steps of every drone that are left for the recovery, if the fault takes all steps before."""
SHORTEST = 20
"""Steps of every drone in an interval. A quarter of it has to hold `RECOVERY`, and three steps lost to rounding."""


class PlannedFault(Struct, frozen=True, kw_only=True):
    """One scheduled fault; steps are environment steps of all drones, prefill included.

    Attributes:
        step: the step of the fault; the training waits there until the fault is prepared.
        fault_until: the step that the training does not pass during the fault; a checkpoint comes before it.
        recovery_until: the step that the training does not pass before it has recovered.
        chance: in [0, 1), for what the scenario leaves open, such as the choice of a worker.
    """

    scenario: str
    step: int
    fault_until: int
    recovery_until: int
    chance: float


def plan(seed: int, faults: int, scenarios: Sequence[str], steps: int, *, drones: int) -> tuple[PlannedFault, ...]:
    """A schedule of faults over a run, in order.

    Every scenario occurs once before any occurs again, and each fault has an interval of the run to itself.

    Raises:
        InvalidInput: the run is too short for so many faults.
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
    """The most steps between two checkpoints such that one comes in the interval of every fault."""
    return int(CHECKPOINT * _stretch(faults, steps))


def strike_times(seed: int, mean: float, seconds: float) -> tuple[float, ...]:
    """The times of faults as a Poisson process with this mean interval, in seconds from the start, up to `seconds`."""
    rng = random.Random(seed)
    moments: list[float] = []
    moment = rng.expovariate(1 / mean)
    while moment < seconds:
        moments.append(moment)
        moment += rng.expovariate(1 / mean)
    return tuple(moments)


def _stretch(faults: int, steps: int) -> float:
    """The interval of each fault, in steps."""
    return (LAST - FIRST) * steps / max(faults, 1)


def _planned(rng: random.Random, scenario: str, begin: float, stretch: float, drones: int) -> PlannedFault:
    """A fault in an interval of a run; its steps are those at which all drones have flown equally many."""
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
