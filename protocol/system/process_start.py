"""When a process was started, on a clock that can't be set: together with its pid, this identifies a process.

A start in seconds since 1970 would not do: the system computes it from the wall clock, so it changes when that is set.
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
        boot: the id of the system's boot; empty if the system has none.
        ticks: of the system's clock since that boot; without `/proc`, hundredths of a second since 1970.
    """

    boot: str
    ticks: int

    @property
    def age(self) -> float:
        """Seconds since then, including those in which the machine slept."""
        if not self.boot:
            return max(0.0, time.time() - self.ticks / _TICKS_OTHERWISE)
        return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - self.ticks / os.sysconf("SC_CLK_TCK"))


def process_start(pid: int, proc: Path = _PROC) -> ProcessStart | None:
    """When the process with a pid was started; None if there is none.

    Args:
        proc: the mount point of procfs.
    """
    try:
        boot = (proc / "sys/kernel/random/boot_id").read_text().strip()
        # A process's name may have spaces, parentheses, and bytes that are not text.
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
    """For systems without boot ids; they store the wall clock's time of the start, and don't compute it again."""
    try:
        return ProcessStart("", round(psutil.Process(pid).create_time() * _TICKS_OTHERWISE))
    except psutil.Error:
        return None
