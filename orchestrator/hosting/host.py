"""An orchestrator for several machines: it starts nobody, but is where workers and runs find each other.

Once the runs are done it lets the workers end, and ends itself. It keeps nothing: killed and started again at the same
address, it hears of everybody within a heartbeat.
"""

import logging
import math
import time
from collections.abc import Callable

from msgspec import Struct

from orchestrator.hosting.joined_runs import JoinedRuns
from orchestrator.monitoring.live_display import Display, Snapshot
from orchestrator.supervision.heartbeat import Health
from orchestrator.supervision.registry import Registry, serve_registry
from protocol.messages import Dismiss, Dismissed, Register, Registered, Role, WorkerRecord
from protocol.observer import NO_OBSERVER, Observer
from protocol.security import LOCAL_ONLY, Security
from protocol.server.server import Handlers
from protocol.system.stop_request import StopRequest
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts

LOOK = 0.1
SHOW = 0.5
GOODBYE = 30.0
"""Seconds that workers are given to finish what is in hand and to fall silent."""

_log = logging.getLogger(__name__)


class HostTable:
    """The registry of a host, which besides knows when all is over. May be used from any number of threads.

    Args:
        stay: it is never over, whatever runs are done.
    """

    def __init__(self, registry: Registry, runs: JoinedRuns, *, stay: bool = False) -> None:
        self._registry = registry
        self._runs = runs
        self._stay = stay

    def handlers(self) -> Handlers:
        """Which request is answered how."""
        return {**self._registry.handlers(), Register: self.register, Dismiss: self.dismiss}

    def register(self, request: Register) -> Registered:
        """Enter a process; a worker is told whether all is over."""
        role = request.worker.role
        if role is Role.AGENT:
            self._runs.note(request.worker)
        self._registry.register(request)
        return Registered(over=role is not Role.AGENT and self.is_over())

    def dismiss(self, request: Dismiss) -> Dismissed:
        """A run is done."""
        self._runs.dismiss(request.incarnation)
        return Dismissed()

    def is_over(self) -> bool:
        """Whether all runs are done, so that nobody needs the workers."""
        return not self._stay and self._runs.are_done()

    def records(self) -> tuple[WorkerRecord, ...]:
        """Everybody who is there."""
        return self._registry.records()

    def workers(self) -> tuple[WorkerRecord, ...]:
        """Those who serve."""
        return tuple(record for record in self.records() if record.role is not Role.AGENT)


class HostOrder(Struct, frozen=True, kw_only=True):
    """What a host is to do.

    Attributes:
        bind: where it serves.
        stay: also when the runs are done.
    """

    bind: str
    stay: bool = False
    security: Security = LOCAL_ONLY
    timeouts: Timeouts = DEFAULT_TIMEOUTS


def host(order: HostOrder, *, display: Display, stop: StopRequest, observer: Observer = NO_OBSERVER) -> None:
    """Serve until somebody asks to stop, or the runs are done and the workers have ended.

    Raises:
        AddressUnavailable: the address is in use, or is none of this machine.
        NotPermitted: other machines can reach it and there is no key, or the key is none of an orchestrator.
    """
    order.security.require_role(Role.ORCHESTRATOR)
    timeouts = order.timeouts
    table = HostTable(Registry(timeouts.liveness), JoinedRuns(timeouts.liveness, timeouts.grace), stay=order.stay)
    with serve_registry(table, order.bind, timeouts, observer, order.security) as check:
        watch = HostWatch(table, f"host at {order.bind}", display, timeouts.liveness)
        while not stop.is_asked and not watch.look():
            check()
            stop.sleep(LOOK)
        if stop.is_asked:
            _log.info("stopped on request; whoever is registered waits %g s for the next host", timeouts.grace)


class HostWatch:
    """Shows who is there, and sees when the host is to end.

    Args:
        settling: seconds from now after which everybody who is there has registered.
    """

    def __init__(
        self,
        table: HostTable,
        name: str,
        display: Display,
        settling: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._table = table
        self._name = name
        self._display = display
        self._clock = clock
        self._began = clock()
        self._settled = self._began + settling
        self._shown = -math.inf
        self._over_since: float | None = None

    def look(self) -> bool:
        """Look at the table; returns whether all is over and nobody has to be waited for."""
        if not self._table.is_over():
            self._over_since = None
            self._show(f"{self._name} is open")
            return False
        if self._over_since is None:
            self._over_since = self._clock()
            _log.info("all runs are done; the workers may end")
        workers = self._table.workers()
        names = ", ".join(record.name or record.address for record in workers)
        if not workers and self._clock() < self._settled:
            # One that was killed and started again knows nobody at first; its workers have to hear that they may end.
            self._show("all runs are done; waiting for workers that have not registered yet")
            return False
        if not workers:
            _log.info("no worker is left; ending")
        elif self._clock() - self._over_since >= GOODBYE:
            _log.warning("%s did not end within %g s and is left to itself; ending", names, GOODBYE)
        else:
            self._show(f"all runs are done; waiting for the end of {names}")
            return False
        return True

    def _show(self, activity: str) -> None:
        if self._clock() - self._shown < SHOW:
            return
        self._shown = self._clock()
        workers = tuple(Health.as_registered(record) for record in self._table.records())
        self._display.show(Snapshot(activity=activity, elapsed=self._clock() - self._began, workers=workers))
