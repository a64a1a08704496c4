"""A signal to one process of a role, after which another has its name."""

import signal

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.children import send
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.run.run_directory import ProcessRecord
from protocol.messages import Role


class Strike(Scenario):
    """A process is hit so that it has to be replaced; nobody else is to be.

    Args:
        role: whose processes one is drawn from, by `chance`.
        number: what it is sent.
        event: what that is to it, in a word.
    """

    def __init__(self, role: Role, chance: float, number: signal.Signals, event: str) -> None:
        self._role = role
        self._chance = chance
        self._number = number
        self._event = event

    def setup(self, run: RehearsedRun) -> None:
        """Choose whom."""
        self._victim = run.member(self._role, self._chance)
        self._others = without(self._victim, run.children.alive())

    def fault(self, run: RehearsedRun) -> float:
        """Send it the signal."""
        send(self._victim, self._number)
        return run.now()

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether it was replaced."""
        return run.successor(self._victim) is not None

    def invariant(self, run: RehearsedRun) -> None:
        """It costs no other process anything."""
        require_unhurt(self._others, by=f"the {self._event} of {self._victim.name}")


def without(process: ProcessRecord, processes: tuple[ProcessRecord, ...]) -> tuple[ProcessRecord, ...]:
    """All the others."""
    return tuple(other for other in processes if other != process)
