"""The health of a worker, as its client knows it from pongs and from pings without an answer."""

import logging
from collections.abc import Callable

from msgspec.structs import replace

from protocol.client.failure_detector import FailureDetector, Suspicion
from protocol.messages import AT_WORK, Pong, Role, State
from protocol.timeouts import Timeouts

_log = logging.getLogger(__name__)


class WorkerHealth:
    """Kept from the moment that a socket is connected until it breaks.

    Args:
        name: of the worker, for the log.
        clock: seconds of the client's monotonic clock.

    Attributes:
        pong: the worker's last pong; None before the first.
        heard: when the last message came from the worker; None before the first.
        suspicion: why the worker gets no calls although it is connected; None if it gets calls.
    """

    def __init__(self, name: str, timeouts: Timeouts, clock: Callable[[], float]) -> None:
        self.pong: Pong | None = None
        self.heard: float | None = None
        self.suspicion: Suspicion | None = None
        self._name = name
        self._timeouts = timeouts
        self._clock = clock
        self._detector = FailureDetector(timeouts.heartbeat, timeouts)

    @property
    def is_starting(self) -> bool:
        """Whether the worker said that it still loads what its handlers need."""
        return self.pong is not None and self.pong.state is State.STARTING

    @property
    def is_at_work(self) -> bool:
        """Whether the worker said that it handles requests, and nothing speaks against it."""
        return self.suspicion is None and self.pong is not None and self.pong.state in AT_WORK

    @property
    def needs_pings(self) -> bool:
        """Whether the worker is pinged even while it holds no calls: the next pong decides whether it gets any."""
        return self.suspicion is not None or self.pong is None or self.is_starting

    @property
    def lacks(self) -> tuple[Role, ...]:
        """The roles of which the worker needs another worker and knows none at work."""
        return () if self.pong is None else self.pong.lacks

    def expect_pings_every(self, heartbeat: float) -> None:
        """Begin to count unanswered pings, at the interval in seconds that both sides agreed on."""
        self._detector = FailureDetector(heartbeat, self._timeouts)

    def hear(self) -> None:
        """A message came from the worker."""
        self.heard = self._clock()
        self._detector.heard()
        self._judge()

    def pinged(self) -> None:
        """A heartbeat's ping goes out."""
        # A worker that loads libraries may be silent for long; the startup timeout is for that.
        if not self.is_starting:
            self._detector.asked()
            self._judge()

    def answered_ping(self, pong: Pong, *, holds_calls: bool) -> None:
        """The worker answered a heartbeat's ping."""
        self.pong = pong
        self._detector.answered(pong, holds_calls=holds_calls)
        self._judge()

    def answered_caller(self, pong: Pong) -> None:
        """The worker answered a caller's own ping. The detector does not count it: callers may ping at any rate."""
        self.pong = pong

    def answered_call(self) -> None:
        """A handler of the worker answered a call."""
        self._detector.moved()

    def refused_as_draining(self) -> None:
        """The worker refused a call because it drains; its next pong would say so."""
        if self.pong is not None:
            self.pong = replace(self.pong, state=State.DRAINING)

    def _judge(self) -> None:
        before, self.suspicion = self.suspicion, self._detector.suspicion
        if self.suspicion is not None and before is None:
            _log.warning("%s gets no more calls: %s", self._name, self.suspicion)
        if self.suspicion is None and before is not None:
            _log.info("%s gets calls again", self._name)
