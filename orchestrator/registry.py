"""Who serves what, where, in which state: what the run's processes say of themselves, and ask of each other."""

import logging
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress

from msgspec import Struct

from protocol.client import Client
from protocol.errors import CallFailed
from protocol.messages import Drain, Lookup, Register, Registered, Role, WorkerRecord, Workers
from protocol.observer import NOBODY, Observer
from protocol.server import Handlers, serve
from protocol.timeouts import Timeouts

STOP_PATIENCE = 5.0

_log = logging.getLogger(__name__)


class Entry(Struct, frozen=True):
    """A process that registered: its last word, when it first and last spoke (seconds of the registry's clock)."""

    record: WorkerRecord
    first: float
    heard: float


class Registry:
    """The table, by incarnation. May be used from any number of threads.

    Args:
        liveness: seconds after which a process that did not register again is no longer listed.
    """

    def __init__(self, liveness: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._liveness = liveness
        self._clock = clock
        self._lock = threading.Lock()
        self._entries: dict[str, Entry] = {}

    def register(self, request: Register) -> Registered:
        """Enter a process, or its new state."""
        record, now = request.worker, self._clock()
        with self._lock:
            self._drop_silent(now)
            known = self._entries.get(record.incarnation)
            self._entries[record.incarnation] = Entry(record, known.first if known else now, now)
        if known is None:
            _log.info("%s registered", record.name or record.address, extra={"incarnation": record.incarnation})
        return Registered()

    def lookup(self, request: Lookup) -> Workers:
        """The processes of a role: of those at one address, the one that came last."""
        with self._lock:
            self._drop_silent(self._clock())
            entries = sorted(self._entries.values(), key=lambda entry: entry.first)
        newest = {entry.record.address or entry.record.name: entry.record for entry in entries}
        return Workers(workers=tuple(record for record in newest.values() if record.role is request.role))

    def heard(self, name: str, pid: int) -> float | None:
        """When the process of this name and number last registered; None where it did not."""
        with self._lock:
            times = [
                entry.heard for entry in self._entries.values() if (entry.record.name, entry.record.pid) == (name, pid)
            ]
        return max(times, default=None)

    def forget(self, name: str, pid: int) -> None:
        """Drop a process that has ended, without waiting for its silence."""
        with self._lock:
            self._entries = {
                incarnation: entry
                for incarnation, entry in self._entries.items()
                if (entry.record.name, entry.record.pid) != (name, pid)
            }

    def handlers(self) -> Handlers:
        """Which request is answered how."""
        return {Register: self.register, Lookup: self.lookup}

    def _drop_silent(self, now: float) -> None:
        self._entries = {
            incarnation: entry for incarnation, entry in self._entries.items() if now - entry.heard < self._liveness
        }


@contextmanager
def serve_registry(
    registry: Registry, address: str, timeouts: Timeouts, observer: Observer = NOBODY
) -> Generator[None]:
    """Answer for a registry at an address, in a thread of its own, watched by `observer`.

    Raises:
        AddressUnavailable: the address can't be served.
    """
    bound, over = threading.Event(), threading.Event()
    failure: list[Exception] = []

    def start() -> Handlers:
        bound.set()
        return registry.handlers()

    def run() -> None:
        try:
            # Anybody who may call may also ask it to drain; but the processes of a run must not become orphans of that.
            while not over.is_set():
                serve(
                    start,
                    role=Role.ORCHESTRATOR,
                    bind=address,
                    computes=False,
                    timeouts=timeouts,
                    observer=observer,
                )
        except Exception as error:
            _log.exception("the registry has failed")
            failure.append(error)
            bound.set()

    thread = threading.Thread(target=run, name="registry", daemon=True)
    thread.start()
    bound.wait()
    if failure:
        raise failure[0]
    try:
        yield
    finally:
        over.set()
        _end(thread, address, timeouts)


def _end(thread: threading.Thread, address: str, timeouts: Timeouts) -> None:
    if thread.is_alive():
        with suppress(CallFailed), Client(address, role=Role.ORCHESTRATOR, timeouts=timeouts) as client:
            client.call(Drain(), deadline=STOP_PATIENCE)
    thread.join(STOP_PATIENCE)
