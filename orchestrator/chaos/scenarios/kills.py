"""SIGKILL to each kind of process."""

import signal

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.process_signal import ProcessSignal
from orchestrator.chaos.scenarios.scenario import Scenario
from protocol.messages import Role

LONGEST_ABSENCE = 5.0
"""Seconds that a run is without an orchestrator at most; less than the grace period of its processes."""


class KillProcess(ProcessSignal):
    """A process is killed.

    Setup: a process of the role runs.
    Fault: SIGKILL.
    Recovery: the process was replaced.
    Invariant: no other process was replaced.
    """

    def __init__(self, role: Role, chance: float) -> None:
        super().__init__(role, chance, signal.SIGKILL, "death")


class KillOrchestrator(Scenario):
    """The orchestrator is killed.

    Setup: workers and agent run.
    Fault: SIGKILL; a while later `orchestrator resume`.
    Recovery: a new orchestrator works on the run.
    Invariant: workers and agent are the same processes.
    """

    def __init__(self, chance: float) -> None:
        self._absence = chance * LONGEST_ABSENCE

    def setup(self, run: RehearsedRun) -> None:
        """Note the processes."""
        self._others = run.children.alive()

    def fault(self, run: RehearsedRun) -> float:
        """Kill the orchestrator, and start another a while later."""
        run.signal_orchestrator(signal.SIGKILL)
        killed = run.now()
        run.sleep(self._absence)
        run.resume()
        return killed

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether a new orchestrator works on the run."""
        return run.directory.is_busy()

    def invariant(self, run: RehearsedRun) -> None:
        """The new orchestrator adopts the processes and starts no others."""
        require_unhurt(self._others, by="the orchestrator's death")
