"""A queue to a thread that polls sockets: any thread puts items, one thread at a time takes them.

Only one thread may use a ZeroMQ socket at a time, so other threads hand it their messages through a mailbox. A mailbox
has a file descriptor that becomes readable with each item, so that one poll waits for items and sockets.
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
        was_signalled: whether a signal had been written to `wakeup_descriptor` by the last `clear_wakeups`.
    """

    def __init__(self) -> None:
        self.was_signalled = False
        self._items: deque[ItemT] = deque()
        self._reader, self._writer = socket.socketpair()
        self._reader.setblocking(False)
        self._writer.setblocking(False)

    def fileno(self) -> int:
        """A descriptor that is readable from an item on until `clear_wakeups`."""
        return self._reader.fileno()

    @property
    def wakeup_descriptor(self) -> int:
        """For `signal.set_wakeup_fd`, which writes each signal's number to it, in any thread."""
        return self._writer.fileno()

    def put(self, item: ItemT) -> None:
        """Put an item. May be called from a signal handler, and after `close`, when no thread takes it any more."""
        self._items.append(item)
        self.wake()

    def put_or_handle(self, item: ItemT, in_use: threading.Lock, handle: Callable[[], None]) -> None:
        """Put an item, and call `handle` in this thread to take it; wake the reader instead while it holds the lock.

        An item that its own thread handles does not wait for the reader's turn on a busy core.
        """
        self._items.append(item)
        if not in_use.acquire(blocking=False):
            self.wake()
            return
        try:
            handle()
        finally:
            in_use.release()

    def wake(self) -> None:
        """Wake the reader."""
        # A full socket has bytes enough to wake the reader; a closed one has no reader.
        with contextlib.suppress(OSError):
            self._writer.send(b"\0")

    def clear_wakeups(self) -> None:
        """Make `fileno` unreadable. The reader calls this before `take`, so that an item put between wakes it again."""
        with contextlib.suppress(OSError):
            self.was_signalled |= any(self._reader.recv(4096))

    def take(self) -> list[ItemT]:
        """The items since the last call, in order."""
        items: list[ItemT] = []
        while self._items:
            items.append(self._items.popleft())
        return items

    def close(self) -> None:
        """Close the descriptors."""
        self._reader.close()
        self._writer.close()
