"""A disk that takes nothing more for a while: every write of the agent to a file fails.

The limit on a file's size stands in for it (`RLIMIT_FSIZE`): it reaches the same `OSError`, needs no rights, and hurts
nobody else on the machine.
"""

import contextlib
import resource
import sys
from collections.abc import Callable

from orchestrator.chaos.invariants import require_unhurt
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenario import Scenario
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
    Fault: every write to a file fails, of this agent and of each that is started in its place, until it has tried to
        write a checkpoint, and for some seconds more.
    Recovery: an agent is there.
    Invariant: the workers, which write nothing, are the same.
    """

    def __init__(self, chance: float) -> None:
        self._seconds = SHORTEST + chance * (LONGEST - SHORTEST)
        self._limited: dict[int, tuple[int, int]] = {}

    def setup(self, run: RehearsedRun) -> None:
        """Note who is there."""
        run.member(Role.AGENT, 0.0)
        self._workers = (*run.crew.alive(Role.RENDER), *run.crew.alive(Role.PERCEPTION))

    def fault(self, run: RehearsedRun) -> float:
        """Fill the disk until a checkpoint was tried."""
        filled = run.now()
        run.failpoints.order(CHECKPOINT, "wait 0")
        try:
            self._keep_full(run, lambda: not run.failpoints.is_pending(CHECKPOINT), "a checkpoint was tried")
            until = run.now() + self._seconds
            self._keep_full(run, lambda: run.now() >= until, "the disk had been full for long enough")
        finally:
            run.failpoints.cancel(CHECKPOINT)
            for pid, (most, _) in self._limited.items():
                limit_files(pid, most)
        return filled

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether somebody trains."""
        return bool(run.crew.alive(Role.AGENT))

    def invariant(self, run: RehearsedRun) -> None:
        """It is the agent's trouble alone."""
        require_unhurt(self._workers, by="the agent's full disk")

    def _keep_full(self, run: RehearsedRun, until: Callable[[], bool], what: str) -> None:
        def is_over() -> bool:
            for agent in run.crew.alive(Role.AGENT):
                if agent.pid not in self._limited:
                    self._limited[agent.pid] = limit_files(agent.pid, 0)
            return until()

        run.wait(is_over, what)


def limit_files(pid: int, size: int) -> tuple[int, int]:
    """Have every write of a process past this many bytes of a file fail; returns the limits that it had.

    A process that is gone is left alone.
    """
    with contextlib.suppress(ProcessLookupError):
        soft, hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, hard))
        return soft, hard
    return resource.RLIM_INFINITY, resource.RLIM_INFINITY
