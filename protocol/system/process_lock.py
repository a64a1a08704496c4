"""A lock that can still be acquired after a fork."""

import os
import threading
from types import TracebackType


class ProcessLock:
    """A lock for the threads of a process; a forked process has a lock of its own.

    A process may be forked while another thread holds a lock. The child has no such thread, so an ordinary lock would
    never be released there.
    """

    def __init__(self) -> None:
        self._locks = {os.getpid(): threading.Lock()}

    def __enter__(self) -> None:
        self._own.acquire()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._own.release()

    @property
    def _own(self) -> threading.Lock:
        return self._locks.setdefault(os.getpid(), threading.Lock())
