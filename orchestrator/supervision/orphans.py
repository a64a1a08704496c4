"""The orphaned processes of a run: those that a killed orchestrator has left running.

They are found in two ways: by `workers.json`, and by their command lines, which follow from the run alone. So a process
that was started an instant before the orchestrator was killed, and is not in the file, is found as well.
"""

import contextlib
import os
import time
from collections.abc import Collection, Iterator, Sequence

import psutil
from msgspec import Struct

from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.heartbeat import is_alive
from orchestrator.supervision.launch import Launch
from protocol.system.process_start import process_start

_LONGEST_EXEC = 1.0
"""Seconds from a program's start until the system shows its command line, on the busiest of machines."""


class Orphan(Struct, frozen=True, eq=False):
    """An orphaned process and the launch that it was started from.

    Attributes:
        log_start: the byte in its log at which its own lines begin; 0 where that was not recorded.
    """

    launch: Launch
    process: psutil.Process
    log_start: int = 0


class Orphans:
    """Which orphans can be adopted, each once, and which have to be ended.

    Args:
        records: the processes that the earlier orchestrator recorded.
        launches: every launch that the run may ever start.
        wanted: the names of the launches whose process is adopted if it runs.

    Attributes:
        unwanted: all other orphans, which have to be ended.
    """

    def __init__(self, records: Sequence[ProcessRecord], launches: Sequence[Launch], wanted: Collection[str]) -> None:
        self._adoptable: dict[str, Orphan] = {}
        self.unwanted: list[Orphan] = []
        known = {record.pid: record for record in records}
        by_command = {launch.command: launch for launch in launches}
        for process, command in _running(set(known)):
            record, launch = known.get(process.pid), by_command.get(command)
            if launch is not None and launch.name in wanted and launch.name not in self._adoptable:
                log_start = record.log_start if record and is_alive(record) else 0
                self._adoptable[launch.name] = Orphan(launch, process, log_start)
            elif launch is not None:
                self.unwanted.append(Orphan(launch, process))
            elif record is not None and is_alive(record):
                self.unwanted.append(Orphan(_launch_of(record), process))

    def has(self, launch: Launch) -> bool:
        """Whether there is a process to adopt for a launch."""
        return launch.name in self._adoptable

    def take(self, launch: Launch) -> Orphan | None:
        """The process to adopt for a launch, if there is one; the next call for the same launch returns None."""
        return self._adoptable.pop(launch.name, None)


def no_orphans() -> Orphans:
    """For a run that can't have any."""
    return Orphans((), (), ())


def _running(known: Collection[int]) -> Iterator[tuple[psutil.Process, tuple[str, ...]]]:
    """Our user's processes and their command lines, those with the `known` numbers first."""
    mine = [process for process in psutil.process_iter(["cmdline", "uids"]) if _is_mine(process)]
    for process in sorted(mine, key=lambda process: process.pid not in known):
        yield process, tuple(process.info["cmdline"] or _command_at_last(process))


def _command_at_last(process: psutil.Process) -> Sequence[str]:
    """The command line of a process that has just been started: the system shows none until all of it is set up."""
    started = process_start(process.pid)
    with contextlib.suppress(psutil.Error):
        # A kernel thread and a zombie never have one.
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
