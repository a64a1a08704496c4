"""A process' standing with the orchestrator: it says how it is, learns who else is there, and when it is to end.

Register goes out at once and then with every heartbeat. An orchestrator that dies is missed, one that is started again
at the same address finds us with the next beat, and after `timeouts.grace` without any, this process is an orphan.
The other way to end is to be told so: by a `Registered` that says that all is over.
"""

import logging
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import NamedTuple, Self

from protocol.client.client import Client
from protocol.client.pool import Pool
from protocol.errors import AddressUnavailable, NotPermitted, VantageError
from protocol.messages import Lookup, Register, Registered, Role, WorkerRecord
from protocol.security import LOCAL_ONLY, Security
from protocol.system.process_lock import ProcessLock
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts

_log = logging.getLogger(__name__)

_LONGEST_GOODBYE = 1.0
"""Seconds that `close` waits for our thread, which may be inside a callback; a process' end waits no longer."""


class Contact(NamedTuple):
    """What the last beat came to.

    Attributes:
        ever: whether the orchestrator has answered any beat.
        silence: seconds without an answer when the last beat began, which came to nothing as well; 0 where it did not.
        trouble: why it came to nothing.
    """

    ever: bool = False
    silence: float = 0.0
    trouble: Exception | None = None


class _Following:
    """Keeps one pool on what the orchestrator says of a role."""

    def __init__(self, pool: Pool, role: Role, patience: float) -> None:
        self.role = role
        self._pool = pool
        self._patience = patience
        self._given = frozenset(pool.addresses)
        self._missed: dict[str, float] = {}

    def update(self, records: tuple[WorkerRecord, ...], now: float) -> None:
        """Add who is new in the table, and let go who has been missing from it for a while."""
        keys = {record.address: record.key for record in records if record.address}
        known = set(keys)
        for address in sorted(known - set(self._pool.addresses)):
            try:
                self._pool.add(address, keys[address])
            except (AddressUnavailable, NotPermitted) as error:
                _log.warning("the orchestrator names a worker that can't be called: %s", error)
        # An orchestrator that was just started again knows nobody, and then only those who were quick to register.
        missing = set(self._pool.addresses) - known - self._given if known else set[str]()
        self._missed = {address: self._missed.get(address, now) for address in missing}
        for address, since in self._missed.items():
            if now - since >= self._patience:
                self._pool.remove(address)


class Membership:
    """Registers a process with the orchestrator for as long as it is open, from a thread of its own.

    Args:
        orchestrator: its address. Nobody needs to be there yet.
        describe: how this process is now; called in our thread, with every beat.
        on_orphaned: called in our thread, once, when no orchestrator answered for `timeouts.grace`. It should only ask
            for the end, and return.
        on_over: called likewise when the orchestrator says that the run is over; without it, that is not heeded. We go
            on telling how this process is until `close`, and do not take it for an orphan any more.

    Raises:
        AddressUnavailable: `orchestrator` is no address.
        NotPermitted: it is on another machine, and there are no keys.
    """

    def __init__(
        self,
        orchestrator: str,
        *,
        describe: Callable[[], WorkerRecord],
        on_orphaned: Callable[[], None],
        on_over: Callable[[], None] | None = None,
        timeouts: Timeouts = DEFAULT_TIMEOUTS,
        security: Security = LOCAL_ONLY,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._orchestrator = orchestrator
        self._describe = describe
        self._on_orphaned = on_orphaned
        self._on_over = on_over
        self._timeouts = timeouts
        self._clock = clock
        self._client = Client(
            orchestrator, role=describe().role, serves=Role.ORCHESTRATOR, timeouts=timeouts, security=security
        )
        self._answered = clock()
        self._missing = False
        self._contact = Contact()
        self._told_to_end = False
        self._table: dict[Role, tuple[WorkerRecord, ...]] = {}
        self._wanted: set[Role] = set()
        self._followings: list[_Following] = []
        self._lock = ProcessLock()
        self._woken = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="membership", daemon=True)
        self._thread.start()

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        """Who serves a role, as the orchestrator said last; empty before its first word about that role."""
        self._want(role)
        return self._table.get(role, ())

    @property
    def contact(self) -> Contact:
        """How we stand with the orchestrator."""
        return self._contact

    def follow(self, pool: Pool, role: Role) -> None:
        """Keep the pool's addresses as the orchestrator's table has them, from its next word on.

        The addresses that the pool has now stay; others go once the table was without them for `timeouts.liveness`.
        Without news, or with an empty table, the pool goes on with what it knows.
        """
        self._want(role)
        with self._lock:
            self._followings.append(_Following(pool, role, self._timeouts.liveness))

    def close(self) -> None:
        """Say no more. What the orchestrator knows of us, it keeps until it misses us."""
        self._over.set()
        self._woken.set()
        self._client.close()
        if threading.current_thread() is not self._thread:
            self._thread.join(_LONGEST_GOODBYE)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _want(self, role: Role) -> None:
        with self._lock:
            if role in self._wanted:
                return
            self._wanted.add(role)
        self._woken.set()

    def _run(self) -> None:
        while not self._over.is_set():
            # Cleared before the beat: what happens during it is told by the next one.
            self._woken.clear()
            self._beat()
            self._woken.wait(self._timeouts.heartbeat)

    def _beat(self) -> None:
        silent = self._clock() - self._answered
        try:
            patience = min(self._timeouts.liveness, max(self._timeouts.heartbeat, self._timeouts.grace - silent))
            reply = self._client.call(Register(worker=self._describe()), deadline=patience)
        except Exception as error:
            # Whatever it is: a thread that ends here would leave a process that nobody ever ends.
            if not self._over.is_set():
                self._miss(error, was_silent=silent)
        else:
            self._hear(reply)
            self._learn()

    def _hear(self, reply: Registered) -> None:
        self._answered = self._clock()
        self._contact = Contact(ever=True)
        if self._missing:
            _log.info("the orchestrator at %s answers again", self._orchestrator)
        self._missing = False
        if reply.over and self._on_over is not None and not self._told_to_end:
            self._told_to_end = True
            _log.info("the run is over, says the orchestrator at %s; ending", self._orchestrator)
            self._tell(self._on_over)

    def _miss(self, error: Exception, *, was_silent: float) -> None:
        self._contact = Contact(self._contact.ever, was_silent, error)
        # Who was told to end has nothing to miss: whoever told it ends as well.
        if not self._missing and not self._told_to_end:
            _log.warning("going on without the orchestrator: %s", error)
        self._missing = True
        # By the silence before this beat: where it was this process that stood still, one more try is due.
        if was_silent >= self._timeouts.grace and not self._told_to_end:
            self._become_orphan()

    def _learn(self) -> None:
        with self._lock:
            wanted, followings = tuple(self._wanted), tuple(self._followings)
        try:
            for role in wanted:
                self._table[role] = self._client.call(Lookup(role=role), deadline=self._timeouts.liveness).workers
            for following in followings:
                following.update(self._table[following.role], self._clock())
        except VantageError as error:
            if not self._over.is_set():
                _log.warning("going on with the workers that are known: %s", error)

    def _become_orphan(self) -> None:
        _log.warning("no orchestrator at %s for %.3g s; ending", self._orchestrator, self._timeouts.grace)
        self._over.set()
        self._tell(self._on_orphaned)

    def _tell(self, callback: Callable[[], None]) -> None:
        try:
            callback()
        except Exception:
            _log.exception("this process could not be told to end")
