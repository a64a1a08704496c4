"""Which threads go first where there are more of them than cores.

A thread that carries messages works for microseconds and is waited for; one that computes works as long as it is let.
Left alike, each of the threads that a message passes through waits its turn behind the computing ones.
"""

import contextlib
import os
import sys
import threading

_COMPUTING = 10


def let_others_go_first() -> None:
    """Give the calling thread, and those that it starts from then on, a lower priority. It can't be taken back."""
    if sys.platform != "linux":
        return
    # On Linux a priority belongs to a thread. A sandbox may forbid it; then everything works, only slower.
    with contextlib.suppress(OSError):
        thread = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, thread, max(_COMPUTING, os.getpriority(os.PRIO_PROCESS, thread)))
