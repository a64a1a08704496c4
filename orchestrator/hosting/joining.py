"""How a run joins a host: it registers there, learns who renders and perceives elsewhere, and says when it is done."""

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
"""Of whom a run needs one at work."""

LOOK = 0.1
_FOR_EVER = 1e9
_ASK_AGAIN = 5.0
_HOPELESS = (NotPermitted, VersionMismatch, WrongRole)
"""What waiting does not help against."""


class Join(Struct, frozen=True, eq=False, kw_only=True):
    """A host to join.

    Attributes:
        options: how an agent is given the same keys, on its command line.
        incarnation: of this process, which is a new one.
    """

    address: str
    security: Security = LOCAL_ONLY
    options: tuple[str, ...] = ()
    incarnation: str = field(default_factory=new_incarnation)


def join_of(
    address: str | None, key: Path | None, allowed: Path | None, *, insecure: bool, environment: Mapping[str, str]
) -> Join | None:
    """What the options `--join`, `--key`, `--allowed` and `--insecure` come to; None without a host.

    Raises:
        InvalidInput: options that have no meaning without a host, or not together.
        AddressUnavailable: the address is none.
        NotPermitted: a file is missing, damaged or open to others, or the key does not count, or not for an agent.
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
            # Not resolved: what a link points to may have no list of allowed keys beside it.
            options += (option, str(path.absolute()))
    return Join(address=address, security=security, options=options)


class JoinedHost:
    """The host as its run knows it; registered there for as long as this is open.

    Raises:
        AddressUnavailable: its address is none.
        NotPermitted: it is on another machine, and there are no keys.
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
            # It never comes to that: `check` says when the host is gone, and the startup clock, when it does not come.
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
        """Who of a role is in the host's table, as it said last. Agents are none of ours."""
        return self._registration.lookup(role) if role in NEEDED else ()

    def follow(self, pool: Pool, role: Role) -> None:
        """Keep a pool's addresses as the host's table has them."""
        self._registration.follow(pool, role)

    def lacks(self, role: Role) -> bool:
        """Whether nobody of a role can work, of those whom a run needs."""
        return role in NEEDED and not any(record.state in AT_WORK for record in self.lookup(role))

    def health(self) -> Iterator[Health]:
        """Everybody whom a run can work with."""
        for role in NEEDED:
            yield from map(Health.as_registered, self.lookup(role))

    def check(self) -> None:
        """Raise `HostLost` if the host has been silent for so long that its workers are about to end."""
        contact = self._registration.contact
        if contact.silence >= self._grace:
            raise HostLost(
                f"the host at {self._address} is gone for {self._grace:g} s (timeouts.grace), and without one its "
                f"workers end: {contact.trouble}"
            )

    def waits_for(self) -> str | None:
        """Who is missing before a run can begin, and where; None where nobody is.

        Raises:
            NotPermitted, VersionMismatch, WrongRole: it is no host to work with.
        """
        contact = self._registration.contact
        if isinstance(contact.trouble, _HOPELESS):
            raise contact.trouble
        if not contact.ever:
            reason = self._name.trouble() or "nobody answers there: does 'orchestrator host' run?"
            return f"a host at {self._address} ({reason})"
        missing = [role for role in NEEDED if self.lacks(role)]
        if not missing:
            return None
        return f"{' and '.join(f'a {role} worker' for role in missing)} to be ready, at the host {self._address}"


class NameLookup:
    """Whether a machine's name means one, asked in a thread of its own: a name server may take long to answer."""

    def __init__(self, host: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._host = host
        self._clock = clock
        self._due = clock() if host else float("inf")
        self._trouble = ""

    def trouble(self) -> str:
        """Why not, as far as is known; asks again every few seconds."""
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
    """Tell the host that the run is done, however often it takes within `timeouts.grace`.

    Args:
        show: told what is being done.

    Raises:
        HostNotTold: it did not answer, or does not take it from us, or somebody asked to stop first.
    """
    told = f"the run is done, and the host at {join.address} was not told, so that its workers stay"
    try:
        with Client(
            join.address, role=Role.AGENT, serves=Role.ORCHESTRATOR, timeouts=timeouts, security=join.security
        ) as client:
            pending = client.submit(Dismiss(incarnation=join.incarnation), deadline=timeouts.grace)
            while not pending.done():
                stop.check()
                show(f"telling the host at {join.address} that the run is done")
                stop.sleep(LOOK, until=pending.done)
            pending.result()
    except VantageError as error:
        raise HostNotTold(f"{told}: {error}") from error
