"""Whether the threads that carry a process's messages still take their turns.

A process may answer HTTP and carry nothing: that is another thread. So each of the threads that count is woken, and has
to move its counter.
"""

import asyncio
from collections.abc import Iterable

from msgspec import Struct

from protocol.observer import Turning

PATIENCE = 1.0
"""Seconds; a turn takes milliseconds, also on a busy machine."""

_POLL = 0.01


class Liveness(Struct, frozen=True):
    """Whether the process carries messages."""

    live: bool


async def liveness(threads: Iterable[Turning], patience: float = PATIENCE) -> Liveness:
    """Whether all of the threads take a turn within `patience` seconds."""
    ends = asyncio.get_running_loop().time() + patience
    waiting = [(thread, thread.turns) for thread in threads]
    while waiting:
        if asyncio.get_running_loop().time() >= ends:
            return Liveness(live=False)
        # Again and again: a thread that works in its place may take the message that was to wake it.
        for thread, _ in waiting:
            thread.wake()
        await asyncio.sleep(_POLL)
        waiting = [(thread, before) for thread, before in waiting if thread.turns == before]
    return Liveness(live=True)
