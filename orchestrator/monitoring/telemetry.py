"""The health and metrics of a run over HTTP: ready while a process of every role is at work.

They come from the snapshots that the display gets. The supervisor belongs to another thread and is not asked.
"""

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager

from msgspec import Struct

from orchestrator.monitoring.live_display import Display, Snapshot
from orchestrator.monitoring.standings import standings_by_role
from protocol.messages import Pong, Role
from protocol.observer import NO_OBSERVER, Finished, Observed, Observer, Turning
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.info import About, Info, info
from protocol.telemetry.process import needs_libraries
from protocol.telemetry.readiness import Wait, waits_for_any
from protocol.telemetry.worker import ObservedWorker, server_telemetry

STALE = 5.0
"""Seconds without a snapshot, after which the state of the processes counts as unknown."""


class ObservedRun:
    """The telemetry of a run: a display that keeps the last snapshot, and an observer of the registry.

    Attributes:
        snapshot: the last one that was shown; None before the first.
        count: called with each finished request to the registry.
    """

    def __init__(self, about: About, display: Display, clock: Callable[[], float] = time.monotonic) -> None:
        self.snapshot: Snapshot | None = None
        self.count: Callable[[Finished], None] = NO_OBSERVER.finished
        self._about = about
        self._display = display
        self._clock = clock
        self._shown = clock()
        self._registry: Observed | None = None

    def show(self, snapshot: Snapshot) -> None:
        """Keep the snapshot, and show it."""
        self.snapshot, self._shown = snapshot, self._clock()
        self._display.show(snapshot)

    def attend(self, worker: Observed) -> None:
        """Observe the server of the registry."""
        self._registry = worker

    def finished(self, request: Finished) -> None:
        """Count a finished request to the registry."""
        self.count(request)

    def pong(self) -> Pong | None:
        """The registry's health; None before it answers."""
        return None if self._registry is None else self._registry.pong()

    def threads(self) -> Iterator[Turning]:
        """The registry's thread."""
        if self._registry is not None:
            yield self._registry

    def waits(self) -> Iterator[Wait]:
        """The roles of which no process is at work, and a display that got no snapshot for a while."""
        if self.snapshot is None:
            yield Wait("start", "no process was started yet")
            return
        if self._clock() - self._shown > STALE:
            yield Wait("look", "the processes were not polled for a while: the orchestrator ends, or hangs")
        for role, standings in standings_by_role(self.snapshot).items():
            yield from waits_for_any(role, standings)

    def info(self) -> Info:
        """The description of the orchestrator."""
        pong = self.pong()
        return info(self._about, incarnation="" if pong is None else pong.incarnation, calls={})


class LastShown:
    """A display that keeps the last snapshot, and passes each on."""

    def __init__(self, display: Display) -> None:
        self.snapshot: Snapshot | None = None
        self._display = display

    def show(self, snapshot: Snapshot) -> None:
        """Keep it, and show it."""
        self.snapshot = snapshot
        self._display.show(snapshot)


class Monitors(Struct, frozen=True, eq=False):
    """The display of a run, and the observer of its registry."""

    display: Display
    registry: Observer = NO_OBSERVER


@contextmanager
def run_telemetry(at: Endpoint | None, run: str, display: Display) -> Generator[Monitors]:
    """Serve the telemetry of a run at an endpoint, if one is given; yields the display and observer for the run.

    Raises:
        AddressUnavailable: the port is in use, or the host is not this machine's.
        Unavailable: a library that this needs is not installed.
    """
    if at is None:
        yield Monitors(display)
        return
    with needs_libraries():
        # Only here: a command that does not serve this does not load it.
        from orchestrator.monitoring.metrics import RunCollector
    watched = ObservedRun(About(role=Role.ORCHESTRATOR, name=run), display)
    with server_telemetry(at, watched, {}) as registry:
        registry.register(RunCollector(lambda: watched.snapshot))
        yield Monitors(watched, watched)


@contextmanager
def host_telemetry(at: Endpoint | None, bind: str, display: Display) -> Generator[Monitors]:
    """As `run_telemetry`, for a host: it is ready as soon as it serves, with or without workers."""
    if at is None:
        yield Monitors(display)
        return
    with needs_libraries():
        from orchestrator.monitoring.metrics import ProcessCollector
    about = About(role=Role.ORCHESTRATOR, name="host", serves=(bind,))
    watched, shown = ObservedWorker(about, {}), LastShown(display)
    with server_telemetry(at, watched, {}) as registry:
        registry.register(ProcessCollector(lambda: shown.snapshot))
        yield Monitors(shown, watched)
