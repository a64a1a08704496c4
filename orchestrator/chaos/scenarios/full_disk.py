"""A full disk: for a while, every write of the agent to a file fails.

The limit on a file's size (`RLIMIT_FSIZE`) simulates it: it raises an `OSError` too, needs no privileges, and does not
affect other processes on the machine.
"""

import contextlib
import resource
import sys

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.orders import carried_out
from orchestrator.chaos.scenarios.scenario import Scenario
from protocol.messages import Role

SHORTEST, LONGEST = 1.0, 3.0
"""Seconds after the agent begins a checkpoint, so that the disk is full while it writes it."""
CHECKPOINT = "checkpoint-opened"
"""The failpoint that tells that a checkpoint begins."""

CAN_FILL_DISKS = sys.platform == "linux"
"""Only Linux can set another process's limits."""


class FullDisk(Scenario):
    """An agent can't write.

    Setup: an agent trains.
    Fault: every write of this agent to a file fails until it has begun a checkpoint, and for some seconds more. Its
        successor can write again, for without that no agent can begin to train.
    Recovery: an agent runs.
    Invariant: the workers, which write no files, are the same processes.
    """

    def __init__(self, chance: float) -> None:
        self._seconds = SHORTEST + chance * (LONGEST - SHORTEST)

    def setup(self, run: RehearsedRun) -> None:
        """Note the processes, and fill the disk."""
        self._agent = run.member(Role.AGENT, 0.0)
        self._workers = (*run.children.alive(Role.RENDER), *run.children.alive(Role.PERCEPTION))
        run.failpoints.order(CHECKPOINT, "wait 0")
        self._filled = run.now()
        self._most, _ = limit_files(self._agent.pid, 0)

    def fault(self, run: RehearsedRun) -> float:
        """Leave the disk full until the agent has begun a checkpoint."""
        try:
            carried_out(run, CHECKPOINT)
            run.sleep(self._seconds)
        finally:
            limit_files(self._agent.pid, self._most)
        return self._filled

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether an agent runs."""
        return bool(run.children.alive(Role.AGENT))

    def invariant(self, run: RehearsedRun) -> None:
        """The workers were not replaced."""
        require_unhurt(self._workers, by="the agent's full disk")


def limit_files(pid: int, size: int) -> tuple[int, int]:
    """Make every write of a process past so many bytes of a file fail; returns its earlier limits.

    Does nothing if the process has ended.
    """
    with contextlib.suppress(ProcessLookupError):
        soft, hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, hard))
        return soft, hard
    return resource.RLIM_INFINITY, resource.RLIM_INFINITY
