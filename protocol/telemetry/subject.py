"""What there is to tell of a process: the questions that its HTTP endpoints ask it."""

from collections.abc import Iterable, Mapping
from typing import Protocol

from protocol.client.diagnosis import Standing
from protocol.messages import Role
from protocol.observer import Turning
from protocol.telemetry.info import Info
from protocol.telemetry.readiness import Wait


class Subject(Protocol):
    """A process. All of it is asked by the HTTP thread, so none of it waits."""

    def threads(self) -> Iterable[Turning]:
        """Those that carry its messages."""
        ...

    def waits(self) -> Iterable[Wait]:
        """What it waits for before it is ready."""
        ...

    def info(self) -> Info:
        """What it is."""
        ...


class Calls(Turning, Protocol):
    """A client of workers of one role, as `protocol.client.pool.Pool` is one."""

    @property
    def addresses(self) -> tuple[str, ...]:
        """Of the workers that calls go to now."""
        ...

    def standings(self) -> tuple[Standing, ...]:
        """How each of them stands."""
        ...


def addresses_called(calls: Mapping[Role, Calls]) -> dict[str, tuple[str, ...]]:
    """Addresses by role."""
    return {role.value: pool.addresses for role, pool in calls.items()}
