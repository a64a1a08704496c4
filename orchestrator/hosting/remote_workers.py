"""Workers of a run that it has not started itself; they may be on other machines."""

from collections.abc import Iterable
from typing import Protocol

from orchestrator.supervision.heartbeat import Health
from protocol.messages import Role, WorkerRecord


class RemoteWorkers(Protocol):
    """The remote workers of a run."""

    def waits_for(self) -> str | None:
        """What is missing, as words to follow "waiting for"; None where the workers are ready.

        Raises:
            VantageError: they refuse us for good.
        """
        ...

    def check(self) -> None:
        """Raise the error that makes it impossible to go on, if there is one."""
        ...

    def health(self) -> Iterable[Health]:
        """The health of each."""
        ...

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        """The workers of a role."""
        ...

    def lacks(self, role: Role) -> bool:
        """Whether the run needs remote workers of a role, and none can work."""
        ...


class _NoRemoteWorkers:
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


NO_REMOTE_WORKERS: RemoteWorkers = _NoRemoteWorkers()
"""For a run that starts all its processes itself."""
