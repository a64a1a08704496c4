"""Signal handlers for a while: set inside a `with` block, and the earlier ones afterwards.

Only the main thread may set handlers, and only it runs them. In any other thread these functions change nothing.
"""

import signal
import threading
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from types import FrameType

ENDING = (signal.SIGTERM, signal.SIGINT)
"""The signals that ask a process to end: a service manager's and Ctrl-C's."""


@contextmanager
def signals_handled(numbers: Iterable[int], handler: Callable[[int], None]) -> Generator[Callable[[], None]]:
    """Call `handler` with the number of each of these signals; yields a function that restores the earlier handlers."""
    if not _in_main_thread():
        yield lambda: None
        return

    def handle(number: int, _frame: FrameType | None) -> None:
        handler(number)

    earlier = {number: signal.signal(number, handle) for number in numbers}

    def restore() -> None:
        for number, previous in earlier.items():
            signal.signal(number, previous)

    try:
        yield restore
    finally:
        restore()


@contextmanager
def signals_written_to(descriptor: int) -> Generator[None]:
    """Have the system write a byte to a descriptor at every signal, so that a wait on it ends."""
    if not _in_main_thread():
        yield
        return
    earlier = signal.set_wakeup_fd(descriptor, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(earlier)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
