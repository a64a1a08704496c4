"""The HTTP endpoints of a worker's process."""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from protocol.client.pool import Pool
from protocol.messages import Pong, Role, State
from protocol.observer import NO_OBSERVER, Finished, Observed, Observer, Turning
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.info import About, Info, info
from protocol.telemetry.process import needs_libraries, process_telemetry
from protocol.telemetry.readiness import Wait, own_waits, waits_for_any
from protocol.telemetry.subject import Subject, addresses_called

if TYPE_CHECKING:
    from prometheus_client import CollectorRegistry


class ObservedWorker:
    """Observes a worker, and answers the HTTP endpoints' questions about it.

    Args:
        calls: the pools that the worker calls, by role; it is ready only while each has a worker at work.

    Attributes:
        count: called with each request that has ended.
    """

    def __init__(self, about: About, calls: Mapping[Role, Pool]) -> None:
        self._about = about
        self._calls = calls
        self._worker: Observed | None = None
        self.count: Callable[[Finished], None] = NO_OBSERVER.finished

    def attend(self, worker: Observed) -> None:
        """The worker starts to answer."""
        self._worker = worker

    def finished(self, request: Finished) -> None:
        """A request has ended."""
        self.count(request)

    def pong(self) -> Pong | None:
        """The worker's pong; None before it answers at its address."""
        return None if self._worker is None else self._worker.pong()

    def threads(self) -> Iterator[Turning]:
        """The I/O threads of the worker and of the pools that it calls."""
        if self._worker is not None:
            yield self._worker
        yield from self._calls.values()

    def waits(self) -> Iterator[Wait]:
        """The worker's own start or end, and the workers that it needs."""
        pong = self.pong()
        yield from own_waits(State.STARTING if pong is None else pong.state)
        for role, pool in self._calls.items():
            yield from waits_for_any(role, pool.standings())

    def info(self) -> Info:
        """The process's description of itself."""
        pong = self.pong()
        return info(
            self._about, incarnation="" if pong is None else pong.incarnation, calls=addresses_called(self._calls)
        )


@contextmanager
def worker_telemetry(
    at: Endpoint | None, about: About, calls: Mapping[Role, Pool] | None = None
) -> Generator[Observer]:
    """Serve how a worker is at an endpoint, or nowhere; yields the observer to serve the worker with.

    Raises:
        AddressUnavailable: the port is in use, or the host is none of this machine's.
        Unavailable: a library that this needs is not installed.
    """
    if at is None:
        yield NO_OBSERVER
        return
    observed = ObservedWorker(about, calls or {})
    with server_telemetry(at, observed, calls or {}):
        yield observed


class ServingSubject(Subject, Protocol):
    """A process that answers requests.

    Attributes:
        count: told of each request that is over.
    """

    count: Callable[[Finished], None]

    def pong(self) -> Pong | None:
        """How the server is; None before it answers at its address."""
        ...


@contextmanager
def server_telemetry(
    at: Endpoint, subject: ServingSubject, calls: Mapping[Role, Pool]
) -> Generator["CollectorRegistry"]:
    """`process_telemetry` of a process that answers requests, with the metrics of these; yields the registry."""
    with needs_libraries():
        # Only here: a process that does not serve this does not load it.
        from protocol.telemetry.metrics import RequestMetrics, WorkerCollector
    with process_telemetry(at, subject, calls) as registry:
        registry.register(WorkerCollector(subject.pong))
        subject.count = RequestMetrics(registry).count
        yield registry
