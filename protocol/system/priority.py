"""Scheduling of threads, where there are more threads than cores.

An I/O thread works for microseconds while others wait for it; a computing thread works without a pause. With equal
priority, every I/O thread that a message passes through would wait for computing threads. So I/O threads request short
time slices, for which Linux (6.12 and newer) interrupts longer ones, and computing threads lower their own priority.
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
"""Seconds that a thread keeps Python's global lock while another waits for it; Python's default is 0.005."""

_SHORT_SLICE = 100_000
"""Nanoseconds: the shortest slice that Linux allows."""

_USUAL_SLICE = 0
_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
_SCHED_OTHER = 0


def let_others_go_first() -> None:
    """Lower the priority of the calling thread, and of threads that it starts from then on, for good.

    In the whole process, a thread that computes in Python also releases the global lock sooner.
    """
    sys.setswitchinterval(_LOCK_HELD)
    if sys.platform != "linux":
        return
    # On Linux a priority belongs to a thread. A sandbox may forbid it; then everything works, only slower.
    with contextlib.suppress(OSError):
        thread = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, thread, max(_COMPUTING, os.getpriority(os.PRIO_PROCESS, thread)))


def go_first() -> None:
    """Let the calling thread, and threads that it starts from then on, interrupt others for short pieces of work."""
    _ask_for_slices(_SHORT_SLICE)


@contextmanager
def going_first() -> Generator[None]:
    """Threads started inside go first; the calling thread is scheduled as usual afterwards."""
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
    # A scheduling policy that the process was given stays.
    if sys.platform != "linux" or number is None or os.sched_getscheduler(0) != _SCHED_OTHER:
        return
    attributes = _SchedulingAttributes(
        size=ctypes.sizeof(_SchedulingAttributes),
        policy=_SCHED_OTHER,
        nice=os.getpriority(os.PRIO_PROCESS, threading.get_native_id()),
        runtime=nanoseconds,
    )
    # Older systems ignore the slice, and a sandbox may forbid the call; then everything works, only slower.
    ctypes.CDLL(None).syscall(number, 0, ctypes.byref(attributes), 0)
