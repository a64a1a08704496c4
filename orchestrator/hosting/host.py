"""A host: an orchestrator for several machines, with which workers register and which runs join; it starts nothing.

Once the runs are done, it tells the workers to end, and ends itself. It stores nothing: when it is killed and started
again at the same address, all processes register again within a heartbeat.
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

POLL = 0.1
SHOW = 0.5
GOODBYE = 30.0
"""Seconds that workers have to answer their requests in hand and end."""

_log = logging.getLogger(__name__)


class HostTable:
    """The registry of a host, which also knows when all runs are done. Thread-safe.

    Args:
        stay: never tell the workers to end.
    """

    def __init__(self, registry: Registry, runs: JoinedRuns, *, stay: bool = False) -> None:
        self._registry = registry
        self._runs = runs
        self._stay = stay

    def handlers(self) -> Handlers:
        """The handler of each request."""
        return {**self._registry.handlers(), Register: self.register, Dismiss: self.dismiss}

    def register(self, request: Register) -> Registered:
        """Enter a process; a worker is told whether it may end."""
        role = request.worker.role
        if role is Role.AGENT:
            self._runs.note(request.worker)
        self._registry.register(request)
        return Registered(over=role is not Role.AGENT and self.is_over())

    def dismiss(self, request: Dismiss) -> Dismissed:
        """Note that a run is done."""
        self._runs.dismiss(request.incarnation)
        return Dismissed()

    def is_over(self) -> bool:
        """Whether all runs are done, so that the workers may end."""
        return not self._stay and self._runs.are_done()

    def records(self) -> tuple[WorkerRecord, ...]:
        """Every registered process."""
        return self._registry.records()

    def workers(self) -> tuple[WorkerRecord, ...]:
        """The registered workers."""
        return tuple(record for record in self.records() if record.role is not Role.AGENT)


class HostOrder(Struct, frozen=True, kw_only=True):
    """The settings of a host.

    Attributes:
        bind: the address at which it serves.
        stay: whether it goes on, with the workers, when the runs are done.
    """

    bind: str
    stay: bool = False
    security: Security = LOCAL_ONLY
    timeouts: Timeouts = DEFAULT_TIMEOUTS


def host(order: HostOrder, *, display: Display, stop: StopRequest, observer: Observer = NO_OBSERVER) -> None:
    """Serve until `stop` is asked, or until the runs are done and the workers have ended.

    Raises:
        AddressUnavailable: the address is in use, or is not of this machine.
        NotPermitted: other machines can reach it and there is no key, or the key is not an orchestrator's.
    """
    order.security.require_role(Role.ORCHESTRATOR)
    timeouts = order.timeouts
    table = HostTable(Registry(timeouts.liveness), JoinedRuns(timeouts.liveness, timeouts.grace), stay=order.stay)
    with serve_registry(table, order.bind, timeouts, observer, order.security) as check:
        monitor = HostMonitor(table, f"host at {order.bind}", display, timeouts.liveness)
        while not stop.is_asked and not monitor.poll():
            check()
            stop.sleep(POLL)
        if stop.is_asked:
            _log.info("stopped on request; registered processes wait %g s for the next host", timeouts.grace)


class HostMonitor:
    """Displays the registered processes, and decides when the host ends.

    Args:
        settling: seconds after which all processes that run now have registered.
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

    def poll(self) -> bool:
        """Check the table; returns whether the host is to end now."""
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
            # The table is empty after a restart of the host; its workers have to register to hear that they may end.
            self._show("all runs are done; waiting for workers that have not registered yet")
            return False
        if not workers:
            _log.info("no worker is left; ending")
        elif self._clock() - self._over_since >= GOODBYE:
            _log.warning("%s did not end within %g s; ending without waiting for it", names, GOODBYE)
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
