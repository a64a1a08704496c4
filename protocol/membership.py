"""A process' standing with the orchestrator: it says how it is, learns who else is there, and notices when it is alone.

Register goes out at once and then with every heartbeat. An orchestrator that dies is missed, one that is started again
at the same address finds us with the next beat, and after `timeouts.grace` without any, this process is an orphan.
"""

import logging
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import NamedTuple, Self

from protocol.client import Client
from protocol.errors import AddressUnavailable, VantageError
from protocol.messages import Lookup, Register, Role, WorkerRecord
from protocol.pool import Pool
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts

_log = logging.getLogger(__name__)

_LONGEST_GOODBYE = 1.0
"""Seconds that `close` waits for our thread, which may be inside a callback; a process' end waits no longer."""


class _Following(NamedTuple):
    pool: Pool
    role: Role
    given: frozenset[str]


class Membership:
    """Registers a process with the orchestrator for as long as it is open, from a thread of its own.

    Args:
        orchestrator: its address. Nobody needs to be there yet.
        describe: how this process is now; called in our thread, with every beat.
        on_orphaned: called in our thread, once, when no orchestrator answered for `timeouts.grace`. It should only ask
            for the end, and return.

    Raises:
        AddressUnavailable: `orchestrator` is no address.
    """

    def __init__(
        self,
        orchestrator: str,
        *,
        describe: Callable[[], WorkerRecord],
        on_orphaned: Callable[[], None],
        timeouts: Timeouts = DEFAULT_TIMEOUTS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._orchestrator = orchestrator
        self._describe = describe
        self._on_orphaned = on_orphaned
        self._timeouts = timeouts
        self._clock = clock
        self._client = Client(orchestrator, role=describe().role, serves=Role.ORCHESTRATOR, timeouts=timeouts)
        self._answered = clock()
        self._missing = False
        self._table: dict[Role, tuple[WorkerRecord, ...]] = {}
        self._wanted: set[Role] = set()
        self._followings: list[_Following] = []
        self._lock = threading.Lock()
        self._woken = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="membership", daemon=True)
        self._thread.start()

    def lookup(self, role: Role) -> tuple[WorkerRecord, ...]:
        """Who serves a role, as the orchestrator said last; empty before its first word about that role."""
        self._want(role)
        return self._table.get(role, ())

    def follow(self, pool: Pool, role: Role) -> None:
        """Keep the pool's addresses as the orchestrator's table has them, from its next word on.

        The addresses that the pool has now stay. Without news, or with an empty table, it goes on with what it knows.
        """
        self._want(role)
        with self._lock:
            self._followings.append(_Following(pool, role, frozenset(pool.addresses)))

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
            self._client.call(Register(worker=self._describe()), deadline=patience)
        except Exception as error:
            # Whatever it is: a thread that ends here would leave a process that nobody ever ends.
            if not self._over.is_set():
                self._miss(error, was_silent=silent)
        else:
            self._hear()
            self._learn()

    def _hear(self) -> None:
        self._answered = self._clock()
        if self._missing:
            _log.info("the orchestrator at %s answers again", self._orchestrator)
        self._missing = False

    def _miss(self, error: Exception, *, was_silent: float) -> None:
        if not self._missing:
            _log.warning("going on without the orchestrator: %s", error)
        self._missing = True
        # By the silence before this beat: where it was this process that stood still, one more try is due.
        if was_silent >= self._timeouts.grace:
            self._become_orphan()

    def _learn(self) -> None:
        with self._lock:
            wanted, followings = tuple(self._wanted), tuple(self._followings)
        try:
            for role in wanted:
                self._table[role] = self._client.call(Lookup(role=role), deadline=self._timeouts.liveness).workers
            for following in followings:
                _update(following, self._table[following.role])
        except VantageError as error:
            if not self._over.is_set():
                _log.warning("going on with the workers that are known: %s", error)

    def _become_orphan(self) -> None:
        _log.warning("no orchestrator at %s for %.3g s; ending", self._orchestrator, self._timeouts.grace)
        self._over.set()
        try:
            self._on_orphaned()
        except Exception:
            _log.exception("this process could not be told that it is an orphan")


def _update(following: _Following, records: tuple[WorkerRecord, ...]) -> None:
    known = {record.address for record in records if record.address}
    if not known:
        return
    have, want = set(following.pool.addresses), following.given | known
    for address in sorted(want - have):
        try:
            following.pool.add(address)
        except AddressUnavailable as error:
            _log.warning("the orchestrator names a worker that can't be reached: %s", error)
    for address in have - want:
        following.pool.remove(address)
