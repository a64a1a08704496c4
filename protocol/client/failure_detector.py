"""Whether a worker lives and gets on, told from its answers to pings.

Both clocks count pings and not seconds, so that a client which stood still itself does not take its own pause for the
worker's: however long it was, only one ping went unanswered.
"""

import math
from enum import StrEnum

from protocol.messages import Pong
from protocol.timeouts import Timeouts

_FEWEST = 2


class Suspicion(StrEnum):
    """What speaks against a worker that its connection says nothing about."""

    SILENT = "it answers no pings"
    STUCK = "it answers pings, and none of its requests"


class FailureDetector:
    """Counts what a worker leaves unanswered.

    Args:
        heartbeat: seconds between two pings, as both sides have agreed.
        timeouts: how long `liveness` and `progress` are; never less than two pings.
    """

    def __init__(self, heartbeat: float, timeouts: Timeouts) -> None:
        self._silent_after = max(_FEWEST, math.ceil(timeouts.liveness / heartbeat))
        self._stuck_after = max(_FEWEST, math.ceil(timeouts.progress / heartbeat))
        self._unanswered = 0
        self._unmoved = 0
        self._stood_still = False
        self._progress: int | None = None

    def asked(self) -> None:
        """A ping goes out; a heartbeat ago there was another, or nothing to ask for."""
        self._unanswered += 1
        # Here and not with each pong: a worker that was stopped answers all pings at once when it goes on.
        self._unmoved += self._stood_still
        self._stood_still = False

    def heard(self) -> None:
        """Something came from the worker."""
        self._unanswered = 0

    def answered(self, pong: Pong, *, holds_calls: bool) -> None:
        """It said how it is; while it holds calls its progress counter has to move."""
        if pong.progress != self._progress:
            self._progress = pong.progress
            self.moved()
        elif holds_calls or self._is_stuck:
            self._stood_still = True

    def moved(self) -> None:
        """It answered a call, which tells as much as its counter."""
        self._unmoved = 0
        self._stood_still = False

    @property
    def suspicion(self) -> Suspicion | None:
        """What speaks against the worker now."""
        if self._unanswered > self._silent_after:
            return Suspicion.SILENT
        return Suspicion.STUCK if self._is_stuck else None

    @property
    def _is_stuck(self) -> bool:
        return self._unmoved >= self._stuck_after
