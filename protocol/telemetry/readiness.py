"""Whether a process can do its work, and what it waits for until it can.

A parent's readiness derives from its children's: as long as none of those that it needs is at work, it is not ready.
"""

from collections.abc import Iterable, Sequence

from msgspec import Struct

from protocol.client.diagnosis import Standing
from protocol.messages import Role, State


class Wait(Struct, frozen=True):
    """One thing that a process waits for: `on` whom or what, and the `reason`, for people."""

    on: str
    reason: str


class Readiness(Struct, frozen=True):
    """Whether a process is ready, which it is as soon as it waits for nothing."""

    ready: bool
    waits_for: tuple[Wait, ...]


def readiness(waits: Iterable[Wait]) -> Readiness:
    """That of a process that waits for all of these."""
    waits_for = tuple(waits)
    return Readiness(ready=not waits_for, waits_for=waits_for)


def own_waits(state: State) -> tuple[Wait, ...]:
    """What a worker in this state waits for, its children left aside."""
    if state is State.STARTING:
        return (Wait("start", "it loads what its handlers need, and warms up"),)
    if state is State.DRAINING:
        return (Wait("end", "it finishes what is in hand and takes no more"),)
    return ()


def waits_for_any(role: Role, standings: Sequence[Standing]) -> tuple[Wait, ...]:
    """What a process waits for that needs one worker of a role at least: none where one is at work, else all."""
    if any(standing.at_work for standing in standings):
        return ()
    if not standings:
        return (Wait(role.value, "none is known"),)
    return tuple(Wait(role.value, f"{standing.address}: {standing.reason}") for standing in standings)
