"""Whether a process can do its work, and what it waits for.

A process that calls workers is ready only while, of each role that it needs, at least one worker is at work.
"""

from collections.abc import Iterable, Sequence

from msgspec import Struct

from protocol.client.diagnosis import Standing
from protocol.messages import Role, State


class Wait(Struct, frozen=True):
    """One thing that a process waits for.

    Attributes:
        on: a role, or `start` or `end`.
        reason: for people.
    """

    on: str
    reason: str


class Readiness(Struct, frozen=True):
    """Whether a process is ready: it is if it waits for nothing."""

    ready: bool
    waits_for: tuple[Wait, ...]


def readiness(waits: Iterable[Wait]) -> Readiness:
    """The readiness of a process with these waits."""
    waits_for = tuple(waits)
    return Readiness(ready=not waits_for, waits_for=waits_for)


def own_waits(state: State) -> tuple[Wait, ...]:
    """What a worker in this state waits for, apart from the workers that it calls."""
    if state is State.STARTING:
        return (Wait("start", "it loads what its handlers need, and warms up"),)
    if state is State.DRAINING:
        return (Wait("end", "it finishes what is in hand and takes no more"),)
    return ()


def waits_for_any(role: Role, standings: Sequence[Standing]) -> tuple[Wait, ...]:
    """What a process waits for that needs a worker of a role: nothing if one is at work, otherwise all of them."""
    if any(standing.at_work for standing in standings):
        return ()
    if not standings:
        return (Wait(role.value, "none is known"),)
    return tuple(Wait(role.value, f"{standing.address}: {standing.reason}") for standing in standings)
