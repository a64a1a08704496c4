"""A process's registration with the orchestrator, which it renews with every heartbeat.

The process sends `Register`, and asks `Lookup` for the workers that it needs. An orchestrator that restarts at the same
address hears of the process within a heartbeat. Without any orchestrator for `timeouts.grace`, the process is an
orphan. A `Registered` with `over` says that the run is over. In both cases the process is told to end.
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
"""Seconds that `close`, and so the end of the process, waits for the thread, which may be inside a callback."""


class Contact(NamedTuple):
    """The result of the last heartbeat.

    Attributes:
        ever: whether the orchestrator has answered any heartbeat.
        silence: seconds without an answer when the last heartbeat began, if that failed as well; 0 if it was answered.
        trouble: why the last heartbeat failed; None if it was answered.
    """

    ever: bool = False
    silence: float = 0.0
    trouble: Exception | None = None


class _Following:
    """Keeps the addresses of one pool as the orchestrator's table has them for a role."""

    def __init__(self, pool: Pool, role: Role, patience: float) -> None:
        self.role = role
        self._pool = pool
        self._patience = patience
        self._given = frozenset(pool.addresses)
        self._missed: dict[str, float] = {}

    def update(self, records: tuple[WorkerRecord, ...], now: float) -> None:
        """Add the workers that are new in the table, and remove those that it has lacked for `patience` seconds."""
        keys = {record.address: record.key for record in records if record.address}
        known = set(keys)
        for address in sorted(known - set(self._pool.addresses)):
            try:
                self._pool.add(address, keys[address])
            except (AddressUnavailable, NotPermitted) as error:
                _log.warning("the orchestrator names a worker that can't be called: %s", error)
        # The table of an orchestrator that has just restarted is empty at first, and fills as workers register.
        missing = set(self._pool.addresses) - known - self._given if known else set[str]()
        self._missed = {address: self._missed.get(address, now) for address in missing}
        for address, since in self._missed.items():
            if now - since >= self._patience:
                self._pool.remove(address)


class Registration:
    """Registers a process with the orchestrator for as long as it is open, from a thread of its own.

    Args:
        orchestrator: its address. It need not answer yet.
        describe: returns the record to register; called in the registration's thread with every heartbeat.
        on_orphaned: called once, in the same thread, when no orchestrator answered for `timeouts.grace`. It should
            request the end of the process, and return.
        on_over: called once, in the same thread, when the orchestrator says that the run is over. Heartbeats continue
            until `close`, and the process no longer becomes an orphan. Without it, the orchestrator's word is ignored.

    Raises:
        AddressUnavailable: `orchestrator` is not an address.
        NotPermitted: the orchestrator is on another machine, and this process has no keys.
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
        self._thread = threading.Thread(target=self._run, name="registration", daemon=True)
        self._thread.start()

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        """The workers of a role in the orchestrator's last answer; empty before the first answer about that role."""
        self._want(role)
        return self._table.get(role, ())

    @property
    def contact(self) -> Contact:
        """The result of the last heartbeat."""
        return self._contact

    def follow(self, pool: Pool, role: Role) -> None:
        """Keep the pool's addresses as the orchestrator's table has them, from its next answer on.

        The addresses that the pool has now stay; others are removed once the table lacked them for `timeouts.liveness`.
        Without an answer, or with an empty table, the pool keeps its addresses.
        """
        self._want(role)
        with self._lock:
            self._followings.append(_Following(pool, role, self._timeouts.liveness))

    def close(self) -> None:
        """Stop the heartbeats. The orchestrator keeps the record until it misses them."""
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
            # Cleared before the heartbeat, so that a role wanted meanwhile is looked up by the next one.
            self._woken.clear()
            self._beat()
            self._woken.wait(self._timeouts.heartbeat)

    def _beat(self) -> None:
        silent = self._clock() - self._answered
        try:
            patience = min(self._timeouts.liveness, max(self._timeouts.heartbeat, self._timeouts.grace - silent))
            reply = self._client.call(Register(worker=self._describe()), deadline=patience)
        except Exception as error:
            # Any error: without this thread an orphan would never end.
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
            _log.info("the orchestrator at %s says that the run is over; ending", self._orchestrator)
            self._tell(self._on_over)

    def _miss(self, error: Exception, *, was_silent: float) -> None:
        self._contact = Contact(self._contact.ever, was_silent, error)
        # A process that was told to end expects the orchestrator to end as well.
        if not self._missing and not self._told_to_end:
            _log.warning("continuing without the orchestrator: %s", error)
        self._missing = True
        # The silence before this heartbeat: if this process itself was stopped, the orchestrator gets one more try.
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
                _log.warning("continuing with the workers that are known: %s", error)

    def _become_orphan(self) -> None:
        _log.warning("no orchestrator at %s for %.3g s; ending", self._orchestrator, self._timeouts.grace)
        self._over.set()
        self._tell(self._on_orphaned)

    def _tell(self, callback: Callable[[], None]) -> None:
        try:
            callback()
        except Exception:
            _log.exception("this process could not be told to end")
