"""SIGSTOP, of each kind of process: it is there, holds its sockets, and does nothing."""

import signal

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_gone, require_unhurt
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.chaos.scenarios.strike import Strike
from protocol.messages import Role

KILLED_RATHER_THAN_CONTINUED = 0.5
"""Share of stopped orchestrators."""


class StopProcess(Strike):
    """A process hangs.

    Setup: one of the role runs.
    Fault: SIGSTOP, for good.
    Recovery: another has its name.
    Invariant: the stopped one is gone, and nobody else was replaced.
    """

    def __init__(self, role: Role, chance: float) -> None:
        super().__init__(role, chance, signal.SIGSTOP, "stop")

    def invariant(self, run: RehearsedRun) -> None:
        """Who hangs is ended, and costs no other process anything."""
        require_gone(self._victim)
        super().invariant(run)


class StopOrchestrator(Scenario):
    """The orchestrator hangs.

    Setup: workers and agent run.
    Fault: SIGSTOP, for longer than anyone else may hang; then it is continued, or killed and another started.
    Recovery: one works on the run.
    Invariant: workers and agent are the very same processes, though it has heard from none of them for that long.
    """

    def __init__(self, chance: float) -> None:
        self._kill = chance < KILLED_RATHER_THAN_CONTINUED

    def setup(self, run: RehearsedRun) -> None:
        """Note who is there."""
        self._others = run.children.alive()

    def fault(self, run: RehearsedRun) -> float:
        """Stop it for a while."""
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
        """Whether one works on the run."""
        return run.directory.is_busy()

    def invariant(self, run: RehearsedRun) -> None:
        """Its own silence is not taken for theirs."""
        require_unhurt(self._others, by="the orchestrator's stop")
