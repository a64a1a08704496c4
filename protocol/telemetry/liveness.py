"""Whether a process's I/O threads still take turns.

The HTTP thread may answer while the I/O threads hang. So each I/O thread is woken, and its count of turns has to grow.
"""

import asyncio
from collections.abc import Iterable

from msgspec import Struct

from protocol.observer import Turning

PATIENCE = 1.0
"""Seconds; a turn takes milliseconds, also on a busy machine."""

_POLL = 0.01


class Liveness(Struct, frozen=True):
    """Whether the process sends and receives messages."""

    live: bool


async def liveness(threads: Iterable[Turning], patience: float = PATIENCE) -> Liveness:
    """Whether all threads take a turn within `patience` seconds."""
    ends = asyncio.get_running_loop().time() + patience
    waiting = [(thread, thread.turns) for thread in threads]
    while waiting:
        if asyncio.get_running_loop().time() >= ends:
            return Liveness(live=False)
        # Repeatedly: another thread may handle the item that was to wake this one (`Mailbox.put_or_handle`).
        for thread, _ in waiting:
            thread.wake()
        await asyncio.sleep(_POLL)
        waiting = [(thread, before) for thread, before in waiting if thread.turns == before]
    return Liveness(live=True)
