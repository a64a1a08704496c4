"""Ctrl-C and SIGTERM as a request that a process polls where it can stop safely, instead of an exception anywhere."""

import signal
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager

from protocol.errors import Interrupted
from protocol.system.signals import ENDING, signals_handled

TERMINAL = (*ENDING, signal.SIGHUP)
"""The signals that end a command: also that of a terminal that closes."""

LONGEST_SLEEP = 0.05


class StopRequest:
    """Whether the process was asked to stop, and whether it was asked again.

    >>> stop = StopRequest()
    >>> stop.ask()
    >>> stop.is_asked, stop.is_urgent
    (True, False)
    """

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
        """Raise `Interrupted` if the process was asked to stop."""
        if self.is_asked:
            raise Interrupted("stopped on request")

    def sleep(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Sleep; a new request to stop, or `until`, ends it early."""
        asked, end = self._asked, time.monotonic() + seconds
        while self._asked == asked and not until() and (left := end - time.monotonic()) > 0:
            time.sleep(min(left, LONGEST_SLEEP))


@contextmanager
def stop_on_signals(numbers: Sequence[int] = TERMINAL, *, once: bool = False) -> Generator[StopRequest]:
    """While inside, these signals ask to stop.

    Args:
        once: the second signal has its earlier handler again, which by default ends the process.
    """
    request = StopRequest()

    def ask(_number: int) -> None:
        request.ask()
        if once:
            restore()

    # Under nohup a closed terminal is to be ignored, and stays so.
    heeded = [number for number in numbers if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN]
    with signals_handled(heeded, ask) as restore:
        yield request
