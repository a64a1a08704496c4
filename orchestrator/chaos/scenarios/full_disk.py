"""A disk that takes nothing more for a while: every write of the agent to a file fails.

The limit on a file's size stands in for it (`RLIMIT_FSIZE`): it reaches the same `OSError`, needs no rights, and hurts
nobody else on the machine.
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
"""Seconds past the beginning of the first checkpoint that is tried, so that its writing falls into them."""
CHECKPOINT = "checkpoint-opened"
"""The failpoint at which we learn that one is tried."""

CAN_FILL_DISKS = sys.platform == "linux"
"""Only there can another process's limits be set."""


class FullDisk(Scenario):
    """An agent can't write.

    Setup: an agent trains.
    Fault: every write of this agent to a file fails, until a checkpoint was tried, and for some seconds more. Who is
        started in its place has room again: without any, nobody can begin to train.
    Recovery: an agent is there.
    Invariant: the workers, which write nothing, are the same.
    """

    def __init__(self, chance: float) -> None:
        self._seconds = SHORTEST + chance * (LONGEST - SHORTEST)

    def setup(self, run: RehearsedRun) -> None:
        """Note who is there, and fill the disk."""
        self._agent = run.member(Role.AGENT, 0.0)
        self._workers = (*run.children.alive(Role.RENDER), *run.children.alive(Role.PERCEPTION))
        run.failpoints.order(CHECKPOINT, "wait 0")
        self._filled = run.now()
        self._most, _ = limit_files(self._agent.pid, 0)

    def fault(self, run: RehearsedRun) -> float:
        """Leave it full until a checkpoint was tried."""
        try:
            carried_out(run, CHECKPOINT)
            run.sleep(self._seconds)
        finally:
            limit_files(self._agent.pid, self._most)
        return self._filled

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether somebody trains."""
        return bool(run.children.alive(Role.AGENT))

    def invariant(self, run: RehearsedRun) -> None:
        """It is the agent's trouble alone."""
        require_unhurt(self._workers, by="the agent's full disk")


def limit_files(pid: int, size: int) -> tuple[int, int]:
    """Have every write of a process past this many bytes of a file fail; returns the limits that it had.

    A process that is gone is left alone.
    """
    with contextlib.suppress(ProcessLookupError):
        soft, hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, hard))
        return soft, hard
    return resource.RLIM_INFINITY, resource.RLIM_INFINITY
