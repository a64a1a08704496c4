"""How a run joins a host: it registers there, looks up the remote workers, and tells the host when it is done."""

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

from msgspec import Struct, field
from msgspec.structs import replace

from orchestrator.errors import HostLost, HostNotTold
from orchestrator.supervision.heartbeat import Health
from protocol.client.client import Client
from protocol.client.pool import Pool
from protocol.errors import InvalidInput, NotPermitted, VantageError, VersionMismatch, WrongRole
from protocol.incarnation import new_incarnation
from protocol.messages import AT_WORK, Dismiss, Role, State, WorkerRecord
from protocol.security import LOCAL_ONLY, Security
from protocol.security.options import KEY_VARIABLE, security_from
from protocol.server.registration import Registration
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts
from protocol.transport.address import host_of

NEEDED = (Role.RENDER, Role.PERCEPTION)
"""The roles of which a run needs a worker."""

POLL = 0.1
_FOR_EVER = 1e9
_ASK_AGAIN = 5.0
_HOPELESS = (NotPermitted, VersionMismatch, WrongRole)
"""Errors that waiting does not cure."""


class Join(Struct, frozen=True, eq=False, kw_only=True):
    """A host to join.

    Attributes:
        options: the options that give an agent the same keys on its command line.
        incarnation: this process's, under which it registers.
    """

    address: str
    security: Security = LOCAL_ONLY
    options: tuple[str, ...] = ()
    incarnation: str = field(default_factory=new_incarnation)


def join_of(
    address: str | None, key: Path | None, allowed: Path | None, *, insecure: bool, environment: Mapping[str, str]
) -> Join | None:
    """The `Join` that the options `--join`, `--key`, `--allowed` and `--insecure` ask for; None without a host.

    Raises:
        InvalidInput: an option needs a host, or two options exclude each other.
        AddressUnavailable: the address is invalid.
        NotPermitted: a file is missing, damaged or open to other users, or the key is not an allowed key of an agent.
    """
    if address is None:
        if key is not None or allowed is not None or insecure:
            raise InvalidInput("--key, --allowed and --insecure are for other machines; they need --join")
        return None
    if key is None and not insecure and environment.get(KEY_VARIABLE):
        key = Path(environment[KEY_VARIABLE])
    security = security_from(key, allowed, insecure=insecure, environment={})
    security.require_role(Role.AGENT)
    security.curve_to(address, Role.ORCHESTRATOR)
    options = ("--insecure",) if insecure else ()
    for option, path in (("--key", key), ("--allowed", allowed)):
        if path is not None:
            # Links are not resolved: the file behind one may have no list of allowed keys beside it.
            options += (option, str(path.absolute()))
    return Join(address=address, security=security, options=options)


class JoinedHost:
    """A run's client of its host; the run is registered there as long as this is open.

    Raises:
        AddressUnavailable: the host's address is invalid.
        NotPermitted: the host is on another machine, and there are no keys.
    """

    def __init__(self, join: Join, run: str, timeouts: Timeouts, clock: Callable[[], float] = time.monotonic) -> None:
        self._address = join.address
        self._grace = timeouts.grace
        self._name = NameLookup(host_of(join.address), clock)
        record = WorkerRecord(
            role=Role.AGENT, address="", incarnation=join.incarnation, state=State.READY, name=run, pid=os.getpid()
        )
        self._registration = Registration(
            join.address,
            describe=lambda: record,
            # Never called, since `grace` never ends: `check` reports a host that is gone, and the startup clock a host
            # that does not come.
            on_orphaned=lambda: None,
            timeouts=replace(timeouts, grace=_FOR_EVER),
            security=join.security,
        )
        for role in NEEDED:
            self._registration.lookup(role)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._registration.close()

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        """The workers of a role in the host's table, as of its last reply. Agents of other runs are not listed."""
        return self._registration.lookup(role) if role in NEEDED else ()

    def follow(self, pool: Pool, role: Role) -> None:
        """Keep a pool's addresses equal to those in the host's table."""
        self._registration.follow(pool, role)

    def lacks(self, role: Role) -> bool:
        """Whether the run needs workers of a role, and none can work."""
        return role in NEEDED and not any(record.state in AT_WORK for record in self.lookup(role))

    def health(self) -> Iterator[Health]:
        """The health of the host's workers."""
        for role in NEEDED:
            yield from map(Health.as_registered, self.lookup(role))

    def check(self) -> None:
        """Raise `HostLost` if the host has been silent for so long that its workers end."""
        contact = self._registration.contact
        if contact.silence >= self._grace:
            raise HostLost(
                f"the host at {self._address} has not answered for {self._grace:g} s (timeouts.grace), after which its "
                f"workers end: {contact.trouble}"
            )

    def waits_for(self) -> str | None:
        """What is missing before the run can begin; None where nothing is.

        Raises:
            NotPermitted, VersionMismatch, WrongRole: the host refuses us.
        """
        contact = self._registration.contact
        if isinstance(contact.trouble, _HOPELESS):
            raise contact.trouble
        if not contact.ever:
            reason = self._name.trouble() or "no answer: does 'orchestrator host' run there?"
            return f"a host at {self._address} ({reason})"
        missing = [role for role in NEEDED if self.lacks(role)]
        if not missing:
            return None
        return f"{' and '.join(f'a {role} worker' for role in missing)} to be ready, at the host {self._address}"


class NameLookup:
    """Looks up a machine's name in a thread of its own, since a name server may take long to answer."""

    def __init__(self, host: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._host = host
        self._clock = clock
        self._due = clock() if host else float("inf")
        self._trouble = ""

    def trouble(self) -> str:
        """Why the name can't be resolved, as far as is known; looks it up again every few seconds."""
        if self._clock() >= self._due:
            self._due = self._clock() + _ASK_AGAIN
            threading.Thread(target=self._ask, name="name-lookup", daemon=True).start()
        return self._trouble

    def _ask(self) -> None:
        try:
            socket.getaddrinfo(self._host, None)
            self._trouble = ""
        except OSError as error:
            self._trouble = f"the name {self._host!r} is unknown here: {error.strerror}"


def dismiss(join: Join, timeouts: Timeouts, show: Callable[[str], None], stop: StopRequest) -> None:
    """Tell the host that the run is done, with retries for `timeouts.grace` seconds.

    Args:
        show: called with what is being done.

    Raises:
        HostNotTold: the host did not answer, or refused, or the command was asked to stop first.
    """
    told = f"the run is done, and the host at {join.address} was not told, so its workers go on"
    try:
        with Client(
            join.address, role=Role.AGENT, serves=Role.ORCHESTRATOR, timeouts=timeouts, security=join.security
        ) as client:
            pending = client.submit(Dismiss(incarnation=join.incarnation), deadline=timeouts.grace)
            while not pending.done():
                stop.check()
                show(f"telling the host at {join.address} that the run is done")
                stop.sleep(POLL, until=pending.done)
            pending.result()
    except VantageError as error:
        raise HostNotTold(f"{told}: {error}") from error
