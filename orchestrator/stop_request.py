"""Ctrl-C and SIGTERM as a request that is looked at where stopping is safe, not as an exception anywhere."""

import signal
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

from orchestrator.errors import Interrupted

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LONGEST_NAP = 0.05


class StopRequest:
    """Whether somebody asked us to stop, and whether they asked twice."""

    def __init__(self) -> None:
        # A plain count: a lock of `threading.Event` could be held by the very code that a signal handler interrupts.
        self._asked = 0

    def ask(self) -> None:
        """Ask once more."""
        self._asked += 1

    @property
    def is_asked(self) -> bool:
        """Stop in order."""
        return self._asked > 0

    @property
    def is_urgent(self) -> bool:
        """Asked again: stop now, whatever is lost."""
        return self._asked > 1

    def check(self) -> None:
        """Raise `Interrupted` if somebody asked us to stop."""
        if self.is_asked:
            raise Interrupted("stopped on request")

    def nap(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Sleep; a new request to stop, or `until`, ends it early."""
        asked, end = self._asked, time.monotonic() + seconds
        while self._asked == asked and not until() and (left := end - time.monotonic()) > 0:
            time.sleep(min(left, LONGEST_NAP))


@contextmanager
def stop_on_signals() -> Generator[StopRequest]:
    """While inside, SIGINT, SIGTERM and SIGHUP ask to stop instead of ending us where we stand."""
    request = StopRequest()

    def ask(_number: int, _frame: FrameType | None) -> None:
        request.ask()

    # Under nohup a closed terminal is to be ignored, and stays so.
    heeded = [number for number in SIGNALS if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN]
    previous = {number: signal.signal(number, ask) for number in heeded}
    try:
        yield request
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
