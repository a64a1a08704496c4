"""The interface between a process and its HTTP endpoints."""

from collections.abc import Iterable, Mapping
from typing import Protocol

from protocol.client.diagnosis import Standing
from protocol.messages import Role
from protocol.observer import Turning
from protocol.telemetry.info import Info
from protocol.telemetry.readiness import Wait


class Subject(Protocol):
    """A process. The HTTP thread calls these methods, so none of them waits."""

    def threads(self) -> Iterable[Turning]:
        """The process's I/O threads."""
        ...

    def waits(self) -> Iterable[Wait]:
        """What the process waits for before it is ready."""
        ...

    def info(self) -> Info:
        """The process's description of itself."""
        ...


class Calls(Turning, Protocol):
    """A client of workers of one role, such as `protocol.client.pool.Pool`."""

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses of the workers."""
        ...

    def standings(self) -> tuple[Standing, ...]:
        """How each worker stands."""
        ...


def addresses_called(calls: Mapping[Role, Calls]) -> dict[str, tuple[str, ...]]:
    """Addresses by role."""
    return {role.value: pool.addresses for role, pool in calls.items()}
