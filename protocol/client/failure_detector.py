"""Whether a worker is alive and makes progress, told by its answers to pings.

Both timeouts are counted in pings, not in seconds. So a client that was stopped itself does not take its own pause for
the worker's: however long the pause was, only one ping went unanswered.
"""

import math
from enum import StrEnum

from protocol.messages import Pong
from protocol.timeouts import Timeouts

_FEWEST = 2


class Suspicion(StrEnum):
    """Why a worker gets no calls although its connection stands."""

    SILENT = "it answers no pings"
    STUCK = "it answers pings, and none of its requests"


class FailureDetector:
    """Counts the pings that a worker does not answer, and those between which it answers no call.

    Args:
        heartbeat: seconds between two pings, as both sides agreed.
        timeouts: `liveness` and `progress` count, as two pings at least.
    """

    def __init__(self, heartbeat: float, timeouts: Timeouts) -> None:
        self._silent_after = max(_FEWEST, math.ceil(timeouts.liveness / heartbeat))
        self._stuck_after = max(_FEWEST, math.ceil(timeouts.progress / heartbeat))
        self._unanswered = 0
        self._unmoved = 0
        self._stood_still = False
        self._progress: int | None = None

    def asked(self) -> None:
        """A ping is sent, a heartbeat after the one before."""
        self._unanswered += 1
        # Here and not with each pong: a worker that was stopped answers all pings at once when it continues.
        self._unmoved += self._stood_still
        self._stood_still = False

    def heard(self) -> None:
        """A message came from the worker."""
        self._unanswered = 0

    def answered(self, pong: Pong, *, holds_calls: bool) -> None:
        """The worker answered a ping; while it holds calls, its progress counter has to move."""
        if pong.progress != self._progress:
            self._progress = pong.progress
            self.moved()
        elif holds_calls or self._is_stuck:
            self._stood_still = True

    def moved(self) -> None:
        """The worker answered a call, which proves progress as its counter does."""
        self._unmoved = 0
        self._stood_still = False

    @property
    def suspicion(self) -> Suspicion | None:
        """Why the worker should get no calls now; None if it should."""
        if self._unanswered > self._silent_after:
            return Suspicion.SILENT
        return Suspicion.STUCK if self._is_stuck else None

    @property
    def _is_stuck(self) -> bool:
        return self._unmoved >= self._stuck_after
