"""A signal to one process of a role, after which it has to be replaced."""

import signal

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.children import send
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.run.process_record import ProcessRecord
from protocol.messages import Role


class ProcessSignal(Scenario):
    """A signal after which a process has to be replaced, and no other process.

    Args:
        role: the role of the process; `chance` chooses one.
        number: the signal.
        event: the effect of the signal, as a word for messages.
    """

    def __init__(self, role: Role, chance: float, number: signal.Signals, event: str) -> None:
        self._role = role
        self._chance = chance
        self._number = number
        self._event = event

    def setup(self, run: RehearsedRun) -> None:
        """Choose the process."""
        self._victim = run.member(self._role, self._chance)
        self._others = without(self._victim, run.children.alive())

    def fault(self, run: RehearsedRun) -> float:
        """Send the signal."""
        send(self._victim, self._number)
        return run.now()

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether the process was replaced."""
        return run.successor(self._victim) is not None

    def invariant(self, run: RehearsedRun) -> None:
        """No other process was replaced."""
        require_unhurt(self._others, by=f"the {self._event} of {self._victim.name}")


def without(process: ProcessRecord, processes: tuple[ProcessRecord, ...]) -> tuple[ProcessRecord, ...]:
    """All processes except one."""
    return tuple(other for other in processes if other != process)
