"""The agent's connections: to the workers that are its sensor, and to the orchestrator, where there is one."""

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from msgspec import Struct

from agent.call_counts import total
from agent.environment.sensor import RemoteSensor
from protocol.client.dispatcher import Statistics
from protocol.client.pool import Pool
from protocol.config import RunConfig
from protocol.incarnation import new_incarnation
from protocol.messages import Role, State, WorkerRecord
from protocol.security import LOCAL_ONLY, Security
from protocol.server.registration import Registration
from protocol.server.registration_settings import RegistrationSettings
from protocol.system.priority import let_others_go_first
from protocol.timeouts import Timeouts


class WorkerAccess(Struct, frozen=True):
    """The addresses of a run's workers; an orchestrator, where there is one, names further ones.

    `security` has the keys to speak with all of them; without keys, they are on this machine.
    """

    render: tuple[str, ...] = ()
    perception: tuple[str, ...] = ()
    registration: RegistrationSettings | None = None
    security: Security = LOCAL_ONLY


class Connections:
    """Open while the process needs workers; `on_orphaned` is called once if the orchestrator is gone for good."""

    def __init__(self, config: RunConfig, workers: WorkerAccess, on_orphaned: Callable[[], None]) -> None:
        timeouts = Timeouts.from_config(config.timeouts)
        self.incarnation = new_incarnation()
        with ExitStack() as opened:
            security = workers.security
            self._render = opened.enter_context(_pool(workers.render, Role.RENDER, timeouts, security))
            self._perception = opened.enter_context(_pool(workers.perception, Role.PERCEPTION, timeouts, security))
            self._is_registered = workers.registration is not None
            if workers.registration is not None:
                registration = opened.enter_context(
                    _registration(workers.registration, self.incarnation, on_orphaned, timeouts, security)
                )
                registration.follow(self._render, Role.RENDER)
                registration.follow(self._perception, Role.PERCEPTION)
            # Only now: the connections' threads keep their priority, so that updates do not delay pictures.
            let_others_go_first()
            self._opened = opened.pop_all()
        self.sensor = RemoteSensor(self._render, self._perception)

    def wait_ready(self) -> None:
        """Wait until all of the workers are ready, or with an orchestrator one of each role.

        Raises:
            DeadlineExceeded: they were not ready within `timeouts.startup`.
            VersionMismatch, WrongRole: a worker speaks another version or has another role.
        """
        for pool in (self._render, self._perception):
            if self._is_registered:
                pool.wait_any_ready()
            else:
                pool.wait_ready()

    @property
    def calls(self) -> Mapping[Role, Pool]:
        """The clients of the workers, by the role of these."""
        return {Role.RENDER: self._render, Role.PERCEPTION: self._perception}

    def statistics(self) -> Statistics:
        """The counts so far."""
        return total(self._render.statistics, self._perception.statistics)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._opened.close()


def _pool(addresses: tuple[str, ...], serves: Role, timeouts: Timeouts, security: Security) -> Pool:
    return Pool(addresses, role=Role.AGENT, serves=serves, timeouts=timeouts, security=security)


def _registration(
    registration: RegistrationSettings,
    incarnation: str,
    on_orphaned: Callable[[], None],
    timeouts: Timeouts,
    security: Security,
) -> Registration:
    # The agent serves no requests, so it has no address and is ready at once.
    record = WorkerRecord(
        role=Role.AGENT,
        address="",
        incarnation=incarnation,
        state=State.READY,
        name=registration.name,
        pid=os.getpid(),
    )
    return Registration(
        registration.orchestrator,
        describe=lambda: record,
        on_orphaned=on_orphaned,
        timeouts=timeouts,
        security=security,
    )
