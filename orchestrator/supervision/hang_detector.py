"""Whether a process is fine or hangs: three clocks, moved by looks at it.

Pure: it is told what is known of the process and what time it is, and decides.
"""

from enum import StrEnum
from typing import Any

from msgspec import Struct

from protocol.timeouts import Timeouts

LONGEST_LOOK = 1.0
"""Seconds that one look can move a clock: time in which we ourselves did not run is nobody's silence."""


class Verdict(StrEnum):
    """What a look comes to."""

    FINE = "fine"
    NEVER_READY = "never ready"
    SILENT = "silent"
    STUCK = "stuck"


class Vitals(Struct, frozen=True, kw_only=True):
    """What is known of a process at one look.

    Attributes:
        ready: it has finished starting.
        expected: it should be heard of at every heartbeat by now.
        heard: when it was last heard of; what counts is whether that changes.
        progress: what it has done so far; likewise.
        busy: it has work in hand, so that `progress` should change.
        waiting: what it depends on does not work, so that it can neither start nor get on.
        stopped: the system lets it stand still (SIGSTOP), so that it is not slow but silent, also while it starts.
    """

    ready: bool
    expected: bool
    heard: float | None = None
    progress: float = 0.0
    busy: bool = False
    waiting: bool = False
    stopped: bool = False


class Patience(Struct, frozen=True, kw_only=True):
    """Seconds of each clock."""

    startup: float
    liveness: float
    progress: float

    @classmethod
    def of_render(cls, timeouts: Timeouts) -> "Patience":
        """For a worker that waits for nobody."""
        return cls(startup=timeouts.startup, liveness=timeouts.liveness, progress=timeouts.progress)

    @classmethod
    def of_perception(cls, timeouts: Timeouts) -> "Patience":
        """For a worker that waits for render workers: one of those that hangs must be found before it."""
        return cls(
            startup=timeouts.startup,
            liveness=timeouts.liveness,
            progress=timeouts.progress + timeouts.liveness,
        )

    @classmethod
    def of_agent(cls, timeouts: Timeouts) -> "Patience":
        """For an agent, whose every call ends by its own deadline."""
        return cls(startup=timeouts.startup, liveness=timeouts.liveness, progress=timeouts.call + timeouts.progress)


class HangDetector:
    """The clocks of one process, from its start to its end.

    Args:
        now: seconds of the clock that `look` will be told.
        age: how long the process has run before we knew it; it is given `liveness` to be heard of at least.
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

    def look(self, vitals: Vitals, now: float) -> Verdict:
        """Take in a look at the process."""
        passed, self._last = min(now - self._last, LONGEST_LOOK), now
        self._move(vitals, passed)
        if (self._silence if vitals.expected else self._stopped) >= self._patience.liveness:
            return Verdict.SILENT
        if not vitals.ready and self._starting >= self._patience.startup:
            return Verdict.SILENT if self._silence >= self._patience.liveness else Verdict.NEVER_READY
        if vitals.ready and self._standstill >= self._patience.progress:
            return Verdict.STUCK
        return Verdict.FINE

    def _move(self, vitals: Vitals, passed: float) -> None:
        self._silence = 0.0 if _changed(vitals.heard, self._heard) else self._silence + passed
        self._heard = vitals.heard
        self._stopped = self._stopped + passed if vitals.stopped else 0.0
        moved = _changed(vitals.progress, self._progress) or not vitals.busy or vitals.waiting
        self._standstill = 0.0 if moved else self._standstill + passed
        self._progress = vitals.progress
        if not (vitals.ready or vitals.waiting):
            self._starting += passed


def _changed(value: Any, before: Any) -> bool:
    return value is not None and value != before
