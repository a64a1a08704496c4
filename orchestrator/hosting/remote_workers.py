"""Those who work for a run and are started by others, perhaps on other machines."""

from collections.abc import Iterable
from typing import Protocol

from orchestrator.supervision.heartbeat import Health
from protocol.messages import Role, WorkerRecord


class RemoteWorkers(Protocol):
    """What a run has to know of them."""

    def waits_for(self) -> str | None:
        """Who is missing, and where, to follow the words "waiting for"; None where they can work.

        Raises:
            VantageError: they will never work with us.
        """
        ...

    def check(self) -> None:
        """Raise what makes it impossible to go on."""
        ...

    def health(self) -> Iterable[Health]:
        """How they are."""
        ...

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        """Who serves a role, and where."""
        ...

    def lacks(self, role: Role) -> bool:
        """Whether the run needs one of a role from them, and there is none that can work."""
        ...


class _Nobody:
    def waits_for(self) -> str | None:
        return None

    def check(self) -> None:
        pass

    def health(self) -> Iterable[Health]:
        return ()

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        return ()

    def lacks(self, role: Role) -> bool:
        return False


NO_REMOTE_WORKERS: RemoteWorkers = _Nobody()
"""For a run whose processes are all started here."""
