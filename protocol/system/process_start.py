"""When a process was started, on a clock that nobody can set: with its number, this tells it from all others.

A start in seconds since 1970 is no such thing: the system computes it from the wall clock, and tells another one each
time that this is set.
"""

import os
import time
from pathlib import Path

import psutil
from msgspec import Struct

_PROC = Path("/proc")
_START_AFTER_NAME = 19
"""Field 22 of `/proc/PID/stat`, counted from the one that follows the name in parentheses, the third."""

_TICKS_OTHERWISE = 100


class ProcessStart(Struct, frozen=True):
    """When a process was started.

    Attributes:
        boot: the id of the system's boot; empty where the system has none.
        ticks: of the system's clock from that boot on; where there is no `/proc`, hundredths of a second since 1970.
    """

    boot: str
    ticks: int

    @property
    def age(self) -> float:
        """Seconds since then, those included in which the machine slept."""
        if not self.boot:
            return max(0.0, time.time() - self.ticks / _TICKS_OTHERWISE)
        return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - self.ticks / os.sysconf("SC_CLK_TCK"))


def process_start(pid: int, proc: Path = _PROC) -> ProcessStart | None:
    """When the process of a number was started; None where there is none.

    Args:
        proc: where the system tells of its processes.
    """
    try:
        boot = (proc / "sys/kernel/random/boot_id").read_text().strip()
        # A name may have spaces and parentheses in it, and bytes that are no text.
        after_name = (proc / str(pid) / "stat").read_bytes().rpartition(b")")[2].split()
        return ProcessStart(boot, int(after_name[_START_AFTER_NAME]))
    except (ProcessLookupError, IndexError):
        return None
    except (OSError, ValueError):
        return _start_by_wall_clock(pid)


def own_start() -> ProcessStart | None:
    """When this process was started."""
    return process_start(os.getpid())


def _start_by_wall_clock(pid: int) -> ProcessStart | None:
    """Where no boot has a name; such systems keep the wall clock's time of the start and don't compute it anew."""
    try:
        return ProcessStart("", round(psutil.Process(pid).create_time() * _TICKS_OTHERWISE))
    except psutil.Error:
        return None
