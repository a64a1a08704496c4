"""Which threads go first where there are more of them than cores.

A thread that carries messages works for microseconds and is waited for; one that computes works as long as it is let.
Left alike, each of the threads that a message passes through waits its turn behind the computing ones. So those that
carry ask for short slices of a core, for which Linux (6.12 and newer) interrupts a longer one, and those that compute
give themselves a lower priority.
"""

import contextlib
import ctypes
import os
import platform
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager

_COMPUTING = 10

_LOCK_HELD = 0.001
"""Seconds that a thread keeps Python's lock while another wants it; Python's own choice is 0.005."""

_SHORT_SLICE = 100_000
"""Nanoseconds: the shortest that Linux gives."""

_USUAL_SLICE = 0
_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
_SCHED_OTHER = 0


def let_others_go_first() -> None:
    """Give the calling thread, and those that it starts from then on, a lower priority. It can't be taken back.

    Whoever computes in Python also gives its lock away sooner, in all of the process.
    """
    sys.setswitchinterval(_LOCK_HELD)
    if sys.platform != "linux":
        return
    # On Linux a priority belongs to a thread. A sandbox may forbid it; then everything works, only slower.
    with contextlib.suppress(OSError):
        thread = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, thread, max(_COMPUTING, os.getpriority(os.PRIO_PROCESS, thread)))


def go_first() -> None:
    """Have the calling thread, and those that it starts from then on, interrupt others for short pieces of work."""
    _ask_for_slices(_SHORT_SLICE)


@contextmanager
def going_first() -> Generator[None]:
    """What is started within goes first; the calling thread afterwards as usual."""
    go_first()
    try:
        yield
    finally:
        _ask_for_slices(_USUAL_SLICE)


class _SchedulingAttributes(ctypes.Structure):
    """`struct sched_attr` of sched_setattr(2), in its first version."""

    _fields_ = [
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    ]


def _ask_for_slices(nanoseconds: int) -> None:
    number = _SCHED_SETATTR.get(platform.machine())
    # Whoever gave the process another policy knows better.
    if sys.platform != "linux" or number is None or os.sched_getscheduler(0) != _SCHED_OTHER:
        return
    attributes = _SchedulingAttributes(
        size=ctypes.sizeof(_SchedulingAttributes),
        policy=_SCHED_OTHER,
        nice=os.getpriority(os.PRIO_PROCESS, threading.get_native_id()),
        runtime=nanoseconds,
    )
    # Older systems pass over the slice, and a sandbox may forbid the call; then everything works, only slower.
    ctypes.CDLL(None).syscall(number, 0, ctypes.byref(attributes), 0)
