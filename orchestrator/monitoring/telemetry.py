"""How a run is, behind an HTTP port: ready while somebody of every role is at work.

It knows what is shown to people, and asks the supervisor nothing, which belongs to another thread.
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
"""Seconds without a look at the processes, after which nobody knows how they are."""


class WatchedRun:
    """Sees what a display sees, and watches the registry; can be asked how the run is.

    Attributes:
        snapshot: the run as it was last shown; None before.
        count: told of each request to the registry that is over.
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
        """Note how the run is, and show it."""
        self.snapshot, self._shown = snapshot, self._clock()
        self._display.show(snapshot)

    def attend(self, worker: Observed) -> None:
        """This answers for the registry now."""
        self._registry = worker

    def finished(self, request: Finished) -> None:
        """A request to the registry is over."""
        self.count(request)

    def pong(self) -> Pong | None:
        """How the registry is; None before it answers."""
        return None if self._registry is None else self._registry.pong()

    def threads(self) -> Iterator[Turning]:
        """The registry's."""
        if self._registry is not None:
            yield self._registry

    def waits(self) -> Iterator[Wait]:
        """The processes of a role of which none is at work, or a look at them."""
        if self.snapshot is None:
            yield Wait("start", "no process was started yet")
            return
        if self._clock() - self._shown > STALE:
            yield Wait("look", "the processes were not looked at for a while: it ends, or hangs")
        for role, standings in standings_by_role(self.snapshot).items():
            yield from waits_for_any(role, standings)

    def info(self) -> Info:
        """What the orchestrator is."""
        pong = self.pong()
        return info(self._about, incarnation="" if pong is None else pong.incarnation, calls={})


class LastShown:
    """Passes on what is shown, and keeps the last of it."""

    def __init__(self, display: Display) -> None:
        self.snapshot: Snapshot | None = None
        self._display = display

    def show(self, snapshot: Snapshot) -> None:
        """Keep it, and show it."""
        self.snapshot = snapshot
        self._display.show(snapshot)


class Monitors(Struct, frozen=True, eq=False):
    """Whom a run is to be shown to, and who is to watch its registry."""

    display: Display
    registry: Observer = NO_OBSERVER


@contextmanager
def run_telemetry(at: Endpoint | None, run: str, display: Display) -> Generator[Monitors]:
    """Serve how a run is at an endpoint, or nowhere; gives what the run is to be worked on with.

    Raises:
        AddressUnavailable: the port is in use, or the host is none of this machine's.
        Unavailable: a library that this needs is not installed.
    """
    if at is None:
        yield Monitors(display)
        return
    with needs_libraries():
        # Only here: a command that does not serve this does not load it.
        from orchestrator.monitoring.metrics import RunCollector
    watched = WatchedRun(About(role=Role.ORCHESTRATOR, name=run), display)
    with server_telemetry(at, watched, {}) as registry:
        registry.register(RunCollector(lambda: watched.snapshot))
        yield Monitors(watched, watched)


@contextmanager
def host_telemetry(at: Endpoint | None, bind: str, display: Display) -> Generator[Monitors]:
    """As `run_telemetry`, for a host: it is ready as soon as it serves, whoever is there."""
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
