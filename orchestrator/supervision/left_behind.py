"""The processes of a run that an earlier orchestrator left behind.

Found twice over: by what it wrote down, and by their command lines, which follow from the run alone. So one that was
started an instant before the orchestrator was killed, and never written down, is found as well.
"""

import contextlib
import os
import time
from collections.abc import Collection, Iterator, Sequence

import psutil
from msgspec import Struct

from orchestrator.run.run_directory import ProcessRecord
from orchestrator.supervision.heartbeat import is_alive
from orchestrator.supervision.launch import Launch
from protocol.system.process_start import process_start

_LONGEST_EXEC = 1.0
"""Seconds between a program's start and its command line being there, on the busiest of machines."""


class Found(Struct, frozen=True, eq=False):
    """A running process and what it was started from.

    Attributes:
        log_start: the byte in its log at which its own lines begin; 0 where that was not written down.
    """

    launch: Launch
    process: psutil.Process
    log_start: int = 0


class LeftBehind:
    """Which of them can be taken up, each once, and which have to be ended.

    Args:
        records: what the earlier orchestrator wrote down.
        launches: everything that the run may ever start.
        wanted: names of those whose process is taken up if it is there; all others are in the way.
    """

    def __init__(self, records: Sequence[ProcessRecord], launches: Sequence[Launch], wanted: Collection[str]) -> None:
        self._takeable: dict[str, Found] = {}
        self.in_the_way: list[Found] = []
        known = {record.pid: record for record in records}
        by_command = {launch.command: launch for launch in launches}
        for process, command in _running(set(known)):
            record, launch = known.get(process.pid), by_command.get(command)
            if launch is not None and launch.name in wanted and launch.name not in self._takeable:
                log_start = record.log_start if record and is_alive(record) else 0
                self._takeable[launch.name] = Found(launch, process, log_start)
            elif launch is not None:
                self.in_the_way.append(Found(launch, process))
            elif record is not None and is_alive(record):
                self.in_the_way.append(Found(_launch_of(record), process))

    def has(self, launch: Launch) -> bool:
        """Whether there is a process to take up for a launch."""
        return launch.name in self._takeable

    def take(self, launch: Launch) -> Found | None:
        """The process that stands for a launch, if there is one; it is asked for once."""
        return self._takeable.pop(launch.name, None)


def nobody() -> LeftBehind:
    """Where nothing can have been left behind."""
    return LeftBehind((), (), ())


def _running(known: Collection[int]) -> Iterator[tuple[psutil.Process, tuple[str, ...]]]:
    """Our own user's processes and their command lines, those with the `known` numbers first."""
    mine = [process for process in psutil.process_iter(["cmdline", "uids"]) if _is_mine(process)]
    for process in sorted(mine, key=lambda process: process.pid not in known):
        yield process, tuple(process.info["cmdline"] or _command_at_last(process))


def _command_at_last(process: psutil.Process) -> Sequence[str]:
    """The command line of a process that was started this moment: the system shows none until all of it is set up."""
    started = process_start(process.pid)
    with contextlib.suppress(psutil.Error):
        # A kernel's thread and a zombie have none, and never will.
        while started is not None and started.age < _LONGEST_EXEC and process.status() != psutil.STATUS_ZOMBIE:
            if command := process.cmdline():
                return command
            time.sleep(0.001)
    return ()


def _is_mine(process: psutil.Process) -> bool:
    uids = process.info["uids"]
    return uids is not None and uids.real == os.getuid() and process.pid != os.getpid()


def _launch_of(record: ProcessRecord) -> Launch:
    return Launch(name=record.name, role=record.role, command=(), address=record.address)
