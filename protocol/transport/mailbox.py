"""Things handed to a thread that waits on sockets: any thread puts, one at a time takes.

A ZeroMQ socket is for one thread at a time, so whatever other threads have for it goes through here; the mailbox has a
file descriptor that becomes readable, which a poll waits on together with the sockets.
"""

import contextlib
import socket
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

ItemT = TypeVar("ItemT")


class Mailbox(Generic[ItemT]):
    """A queue that wakes its reader out of a poll.

    Attributes:
        was_signalled: whether a signal came in by `bell`, as far as `hear` was called since.
    """

    def __init__(self) -> None:
        self.was_signalled = False
        self._items: deque[ItemT] = deque()
        self._reader, self._writer = socket.socketpair()
        self._reader.setblocking(False)
        self._writer.setblocking(False)

    def fileno(self) -> int:
        """Readable when there may be something to take, until `hear`."""
        return self._reader.fileno()

    @property
    def bell(self) -> int:
        """For `signal.set_wakeup_fd`: each signal's number is written to it, whichever thread the signal hits."""
        return self._writer.fileno()

    def put(self, item: ItemT) -> None:
        """Hand over an item. May be called from a signal handler, and after `close`, when nobody takes it."""
        self._items.append(item)
        self.ring()

    def put_or_handle(self, item: ItemT, in_use: threading.Lock, handle: Callable[[], None]) -> None:
        """Hand over an item and have `handle` take it right here; or wake the reader, if the lock says that it works.

        What a thread handles by itself has one thread less to wait for, each with its turn on a busy core.
        """
        self._items.append(item)
        if not in_use.acquire(blocking=False):
            self.ring()
            return
        try:
            handle()
        finally:
            in_use.release()

    def ring(self) -> None:
        """Wake the reader."""
        # A full pipe has bytes enough to wake the reader; a closed one has no reader left to wake.
        with contextlib.suppress(OSError):
            self._writer.send(b"\0")

    def hear(self) -> None:
        """The reader is awake. To be called before `take`: what is put in between wakes it once more."""
        with contextlib.suppress(OSError):
            self.was_signalled |= any(self._reader.recv(4096))

    def take(self) -> list[ItemT]:
        """All that was put since the last time, in order."""
        items: list[ItemT] = []
        while self._items:
            items.append(self._items.popleft())
        return items

    def close(self) -> None:
        """Give the descriptors back."""
        self._reader.close()
        self._writer.close()
