"""SIGSTOP to each kind of process: it exists, holds its sockets, and does nothing."""

import signal

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_gone, require_unhurt
from orchestrator.chaos.scenarios.process_signal import ProcessSignal
from orchestrator.chaos.scenarios.scenario import Scenario
from protocol.messages import Role

KILLED_RATHER_THAN_CONTINUED = 0.5
"""Share of stopped orchestrators."""


class StopProcess(ProcessSignal):
    """A process hangs.

    Setup: a process of the role runs.
    Fault: SIGSTOP, without SIGCONT.
    Recovery: the process was replaced.
    Invariant: the stopped process has ended, and no other process was replaced.
    """

    def __init__(self, role: Role, chance: float) -> None:
        super().__init__(role, chance, signal.SIGSTOP, "stop")

    def invariant(self, run: RehearsedRun) -> None:
        """The hung process has ended, and no other process was replaced."""
        require_gone(self._victim)
        super().invariant(run)


class StopOrchestrator(Scenario):
    """The orchestrator hangs.

    Setup: workers and agent run.
    Fault: SIGSTOP, for longer than any other process may hang; then SIGCONT, or SIGKILL and `orchestrator resume`.
    Recovery: an orchestrator works on the run.
    Invariant: workers and agent are the same processes, though the orchestrator did not hear from them for that long.
    """

    def __init__(self, chance: float) -> None:
        self._kill = chance < KILLED_RATHER_THAN_CONTINUED

    def setup(self, run: RehearsedRun) -> None:
        """Note the processes."""
        self._others = run.children.alive()

    def fault(self, run: RehearsedRun) -> float:
        """Stop the orchestrator for a while."""
        run.signal_orchestrator(signal.SIGSTOP)
        stopped = run.now()
        run.sleep(2 * run.timeouts.liveness)
        if self._kill:
            run.signal_orchestrator(signal.SIGKILL)
            run.resume()
        else:
            run.signal_orchestrator(signal.SIGCONT)
        return stopped

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether an orchestrator works on the run."""
        return run.directory.is_busy()

    def invariant(self, run: RehearsedRun) -> None:
        """The orchestrator does not count its own pause as their silence."""
        require_unhurt(self._others, by="the orchestrator's stop")
