"""Decides whether a process hangs, by three clocks that each poll of the process advances.

Pure: it takes the result of a health probe and the time, and returns a verdict.
"""

from enum import StrEnum
from typing import Any

from msgspec import Struct

from protocol.timeouts import Timeouts

LONGEST_STEP = 1.0
"""Seconds that one poll can advance a clock: time in which the orchestrator itself did not run is no silence."""


class Verdict(StrEnum):
    """What a poll of a process found."""

    FINE = "fine"
    NEVER_READY = "never ready"
    SILENT = "silent"
    STUCK = "stuck"


class ProbeResult(Struct, frozen=True, kw_only=True):
    """The state of a process at one poll.

    Attributes:
        ready: it has finished starting.
        expected: it should send a sign of life at every heartbeat by now.
        heard: when it last did; only a change counts.
        progress: how much it has done so far; only a change counts.
        busy: it has work in hand, so `progress` should change.
        waiting: a worker that it needs is not ready, so it can neither finish starting nor make progress.
        stopped: the system has stopped it (SIGSTOP); it counts as silent, also while it starts.
    """

    ready: bool
    expected: bool
    heard: float | None = None
    progress: float = 0.0
    busy: bool = False
    waiting: bool = False
    stopped: bool = False


class Patience(Struct, frozen=True, kw_only=True):
    """The limit of each clock, in seconds."""

    startup: float
    liveness: float
    progress: float

    @classmethod
    def of_render(cls, timeouts: Timeouts) -> "Patience":
        """For a worker that needs no other."""
        return cls(startup=timeouts.startup, liveness=timeouts.liveness, progress=timeouts.progress)

    @classmethod
    def of_perception(cls, timeouts: Timeouts) -> "Patience":
        """For a worker that needs render workers: a render worker that hangs must be found first."""
        return cls(
            startup=timeouts.startup,
            liveness=timeouts.liveness,
            progress=timeouts.progress + timeouts.liveness,
        )

    @classmethod
    def of_agent(cls, timeouts: Timeouts) -> "Patience":
        """For an agent, whose calls end by their own deadlines."""
        return cls(startup=timeouts.startup, liveness=timeouts.liveness, progress=timeouts.call + timeouts.progress)


class HangDetector:
    """The clocks of one process, from its start to its end.

    Args:
        now: seconds of the clock that `update` takes.
        age: seconds that the process ran before it was supervised; it still has at least `liveness` to be heard.
    """

    def __init__(self, patience: Patience, now: float, age: float = 0.0) -> None:
        self._patience = patience
        self._last = now
        self._starting = max(0.0, min(age, patience.startup - patience.liveness))
        self._silence = 0.0
        self._stopped = 0.0
        self._standstill = 0.0
        self._heard: float | None = None
        self._progress: float | None = None

    def update(self, result: ProbeResult, now: float) -> Verdict:
        """Advance the clocks by a poll of the process."""
        passed, self._last = min(now - self._last, LONGEST_STEP), now
        self._move(result, passed)
        if (self._silence if result.expected else self._stopped) >= self._patience.liveness:
            return Verdict.SILENT
        if not result.ready and self._starting >= self._patience.startup:
            return Verdict.SILENT if self._silence >= self._patience.liveness else Verdict.NEVER_READY
        if result.ready and self._standstill >= self._patience.progress:
            return Verdict.STUCK
        return Verdict.FINE

    def _move(self, result: ProbeResult, passed: float) -> None:
        self._silence = 0.0 if _changed(result.heard, self._heard) else self._silence + passed
        self._heard = result.heard
        self._stopped = self._stopped + passed if result.stopped else 0.0
        moved = _changed(result.progress, self._progress) or not result.busy or result.waiting
        self._standstill = 0.0 if moved else self._standstill + passed
        self._progress = result.progress
        if not (result.ready or result.waiting):
            self._starting += passed


def _changed(value: Any, before: Any) -> bool:
    return value is not None and value != before
