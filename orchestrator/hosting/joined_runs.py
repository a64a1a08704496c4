"""The runs that work with a host's workers: which of them are under way, and whether all are done."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from protocol.messages import WorkerRecord

_log = logging.getLogger(__name__)


@dataclass(slots=True)
class _JoinedRun:
    """One process of a run; `first` and `heard` are seconds of our clock."""

    name: str
    first: float
    heard: float
    done: bool = False


class JoinedRuns:
    """Told of every beat of a run and of its end. May be used from any number of threads.

    A run that falls silent without a word is waited for: its machine may be rebooting, its container starting again.

    Args:
        liveness: seconds that one is waited for whose successor, of the same name, has come.
        grace: seconds that one is waited for otherwise.
    """

    def __init__(self, liveness: float, grace: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._liveness = liveness
        self._grace = grace
        self._clock = clock
        self._lock = threading.Lock()
        self._runs: dict[str, _JoinedRun] = {}

    def note(self, run: WorkerRecord) -> None:
        """A run is under way. Of one that is done this is an earlier word, which was late."""
        now = self._clock()
        with self._lock:
            self._runs.setdefault(run.incarnation, _JoinedRun(run.name, now, now)).heard = now

    def dismiss(self, incarnation: str) -> None:
        """A run is done; it may be one that we never heard of, since we were started again."""
        now = self._clock()
        with self._lock:
            run = self._runs.setdefault(incarnation, _JoinedRun("", now, now))
            is_news, run.done = not run.done, True
        if is_news:
            _log.info("%s is done", run.name or "a run", extra={"incarnation": incarnation})

    def under_way(self) -> tuple[str, ...]:
        """The names of those that are not done."""
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
        """Whether one is done at least, and none is under way."""
        with self._lock:
            any_done = any(run.done for run in self._runs.values())
        return any_done and not self.under_way()
