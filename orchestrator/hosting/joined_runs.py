"""The runs that have joined a host: which of them are under way, and whether all are done."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from protocol.messages import WorkerRecord

_log = logging.getLogger(__name__)


@dataclass(slots=True)
class _JoinedRun:
    """One process of a run; `first` and `heard` are seconds of the host's clock."""

    name: str
    first: float
    heard: float
    done: bool = False


class JoinedRuns:
    """Keeps each run's last heartbeat and whether it is done. Thread-safe.

    A run that falls silent before it is done counts as under way for a while: its machine may be rebooting.

    Args:
        liveness: seconds of silence for which a run is waited for that a later one of the same name has replaced.
        grace: seconds of silence for which any other run is waited for.
    """

    def __init__(self, liveness: float, grace: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._liveness = liveness
        self._grace = grace
        self._clock = clock
        self._lock = threading.Lock()
        self._runs: dict[str, _JoinedRun] = {}

    def note(self, run: WorkerRecord) -> None:
        """Note a heartbeat of a run; one that arrives after the run is done was late, and changes nothing."""
        now = self._clock()
        with self._lock:
            self._runs.setdefault(run.incarnation, _JoinedRun(run.name, now, now)).heard = now

    def dismiss(self, incarnation: str) -> None:
        """Note that a run is done; after a restart of the host it may be an unknown one."""
        now = self._clock()
        with self._lock:
            run = self._runs.setdefault(incarnation, _JoinedRun("", now, now))
            is_news, run.done = not run.done, True
        if is_news:
            _log.info("%s is done", run.name or "a run", extra={"incarnation": incarnation})

    def under_way(self) -> tuple[str, ...]:
        """The names of the runs that are not done."""
        now = self._clock()
        with self._lock:
            newest = {run.name: run.first for run in sorted(self._runs.values(), key=lambda run: run.first)}
            waited_for = [
                run
                for run in self._runs.values()
                if now - run.heard < (self._grace if run.first == newest[run.name] else self._liveness)
            ]
            return tuple(run.name for run in waited_for if not run.done)

    def are_done(self) -> bool:
        """Whether at least one run is done, and none is under way."""
        with self._lock:
            any_done = any(run.done for run in self._runs.values())
        return any_done and not self.under_way()
