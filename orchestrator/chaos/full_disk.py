"""A disk that takes nothing more for a while: every write of the agent to a file fails.

The limit on a file's size stands in for it (`RLIMIT_FSIZE`): it reaches the same `OSError`, needs no rights, and hurts
nobody else on the machine.
"""

import contextlib
import resource
import sys

from orchestrator.chaos.invariants import require_unhurt
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenario import Scenario
from protocol.messages import Role

LONGEST = 6.0
SHORTEST = 1.0

CAN_FILL_DISKS = sys.platform == "linux"
"""Only there can another process's limits be set."""


class FullDisk(Scenario):
    """An agent can't write.

    Setup: an agent trains.
    Fault: for some seconds every write to a file fails, of this agent and of each that is started in its place.
    Recovery: an agent is there.
    Invariant: the workers, which write nothing, are the same.
    """

    def __init__(self, chance: float) -> None:
        self._seconds = SHORTEST + chance * (LONGEST - SHORTEST)

    def setup(self, run: RehearsedRun) -> None:
        """Note who is there."""
        run.member(Role.AGENT, 0.0)
        self._workers = (*run.crew.alive(Role.RENDER), *run.crew.alive(Role.PERCEPTION))

    def fault(self, run: RehearsedRun) -> float:
        """Limit the agent, and each that is started in its place while the disk is full."""
        begun = run.now()
        limited: dict[int, tuple[int, int]] = {}
        try:
            while run.now() < begun + self._seconds:
                for agent in run.crew.alive(Role.AGENT):
                    if agent.pid not in limited:
                        limited[agent.pid] = limit_files(agent.pid, 0)
                run.nap(0.1)
        finally:
            for pid, (most, _) in limited.items():
                limit_files(pid, most)
        return begun

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether somebody trains."""
        return bool(run.crew.alive(Role.AGENT))

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
