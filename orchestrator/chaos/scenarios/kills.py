"""SIGKILL, of each kind of process."""

import signal

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.chaos.scenarios.strike import Strike
from protocol.messages import Role

LONGEST_ABSENCE = 5.0
"""Seconds that a run may be without an orchestrator here; within the grace of all that work on it."""


class KillProcess(Strike):
    """A process dies.

    Setup: one of the role runs.
    Fault: SIGKILL.
    Recovery: another has its name.
    Invariant: nobody else was replaced.
    """

    def __init__(self, role: Role, chance: float) -> None:
        super().__init__(role, chance, signal.SIGKILL, "death")


class KillOrchestrator(Scenario):
    """The orchestrator dies.

    Setup: workers and agent run.
    Fault: SIGKILL; a while later somebody calls `orchestrator resume`.
    Recovery: a new one works on the run.
    Invariant: workers and agent are the very same processes.
    """

    def __init__(self, chance: float) -> None:
        self._absence = chance * LONGEST_ABSENCE

    def setup(self, run: RehearsedRun) -> None:
        """Note who is there."""
        self._others = run.children.alive()

    def fault(self, run: RehearsedRun) -> float:
        """Kill it, and start another a while later."""
        run.signal_orchestrator(signal.SIGKILL)
        killed = run.now()
        run.sleep(self._absence)
        run.resume()
        return killed

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether a new one has taken up the run."""
        return run.directory.is_busy()

    def invariant(self, run: RehearsedRun) -> None:
        """It takes in those who are there rather than start others."""
        require_unhurt(self._others, by="the orchestrator's death")
