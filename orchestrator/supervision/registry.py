"""The registry: which process serves which role, where, and in which state."""

import logging
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from typing import Protocol

from msgspec import Struct

from protocol.messages import Lookup, Register, Registered, Role, WorkerRecord, Workers
from protocol.observer import NO_OBSERVER, Observer
from protocol.security import LOCAL_ONLY, Security
from protocol.server.server import Handlers, serve
from protocol.timeouts import Timeouts

STOP_PATIENCE = 5.0

_log = logging.getLogger(__name__)


class Entry(Struct, frozen=True):
    """A process's last record, and when it first and last registered (seconds of the registry's clock)."""

    record: WorkerRecord
    first: float
    heard: float


class Registry:
    """The table of registered processes, by incarnation. Thread-safe.

    Args:
        liveness: seconds after which a process that did not register again is no longer listed.
        beyond: the processes of a role in another registry, which `lookup` lists after our own.
    """

    def __init__(
        self,
        liveness: float,
        clock: Callable[[], float] = time.monotonic,
        beyond: Callable[[Role], tuple[WorkerRecord, ...]] = lambda _: (),
    ) -> None:
        self._liveness = liveness
        self._beyond = beyond
        self._clock = clock
        self._lock = threading.Lock()
        self._entries: dict[str, Entry] = {}

    def register(self, request: Register) -> Registered:
        """Enter a process, or update its state."""
        record, now = request.worker, self._clock()
        with self._lock:
            self._drop_silent(now)
            known = self._entries.get(record.incarnation)
            self._entries[record.incarnation] = Entry(record, known.first if known else now, now)
        if known is None:
            _log.info("%s registered", record.name or record.address, extra={"incarnation": record.incarnation})
        return Registered()

    def lookup(self, request: Lookup) -> Workers:
        """The processes of a role, here and in the registry beyond."""
        here = tuple(record for record in self.records() if record.role is request.role)
        return Workers(workers=(*here, *self._beyond(request.role)))

    def records(self) -> tuple[WorkerRecord, ...]:
        """Every process that is registered here; of several at one address, the last one."""
        with self._lock:
            self._drop_silent(self._clock())
            entries = sorted(self._entries.values(), key=lambda entry: entry.first)
        return tuple({entry.record.address or entry.record.name: entry.record for entry in entries}.values())

    def heard(self, name: str, pid: int) -> float | None:
        """When the process of this name and id last registered; None where it never did."""
        with self._lock:
            times = [
                entry.heard for entry in self._entries.values() if (entry.record.name, entry.record.pid) == (name, pid)
            ]
        return max(times, default=None)

    def forget(self, name: str, pid: int) -> None:
        """Drop a process that has ended, without waiting for `liveness`."""
        with self._lock:
            self._entries = {
                incarnation: entry
                for incarnation, entry in self._entries.items()
                if (entry.record.name, entry.record.pid) != (name, pid)
            }

    def handlers(self) -> Handlers:
        """The handler of each request."""
        return {Register: self.register, Lookup: self.lookup}

    def _drop_silent(self, now: float) -> None:
        self._entries = {
            incarnation: entry for incarnation, entry in self._entries.items() if now - entry.heard < self._liveness
        }


class Table(Protocol):
    """A registry that can be served."""

    def handlers(self) -> Handlers:
        """The handler of each request."""
        ...


class _End:
    """Ends a server in another thread, also one that is about to start."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._drain: Callable[[], None] = lambda: None
        self.is_due = False

    def take(self, drain: Callable[[], None]) -> None:
        """Set what drains the present server."""
        with self._lock:
            self._drain = drain
            if self.is_due:
                drain()

    def __call__(self) -> None:
        with self._lock:
            self.is_due = True
            self._drain()


class _Server:
    """Serves a registry in a thread of its own until it is stopped.

    Args:
        serve_once: serves until it is drained, as `protocol.serve` does with everything but its handlers told.
    """

    def __init__(self, serve_once: Callable[..., None], registry: Table) -> None:
        self._serve_once = serve_once
        self._registry = registry
        self._bound, self._end = threading.Event(), _End()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="registry", daemon=True)

    def start(self) -> None:
        """Wait until the address answers; raises the error if it can't be served."""
        self._thread.start()
        self._bound.wait()
        self.check()

    def check(self) -> None:
        """Raise the error that ended the server, if one did."""
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """End the server."""
        self._end()
        self._thread.join(STOP_PATIENCE)

    def _run(self) -> None:
        try:
            # Every permitted client may send a Drain; the run's processes must not lose their registry by one.
            while not self._end.is_due:
                self._serve_once(self._handlers, hand_over=self._end.take)
        except Exception as error:
            self._failure = error
            if self._bound.is_set():
                _log.exception("the registry has failed")
            self._bound.set()

    def _handlers(self) -> Handlers:
        self._bound.set()
        return self._registry.handlers()


@contextmanager
def serve_registry(
    registry: Table,
    address: str,
    timeouts: Timeouts,
    observer: Observer = NO_OBSERVER,
    security: Security = LOCAL_ONLY,
) -> Generator[Callable[[], None]]:
    """Serve a registry at an address, in a thread of its own; `observer` is told of its requests.

    Yields a function that raises the error that ended the server, if one did.

    Raises:
        AddressUnavailable: the address can't be served.
        NotPermitted: other machines can reach it, and there is no key.
    """
    server = _Server(
        partial(
            serve,
            role=Role.ORCHESTRATOR,
            bind=address,
            computes=False,
            timeouts=timeouts,
            security=security,
            observer=observer,
        ),
        registry,
    )
    server.start()
    try:
        yield server.check
    finally:
        server.stop()
