"""What a fault is: Setup → Fault → Recovery → Invariant, each a method; a scenario is played once."""

from abc import ABC, abstractmethod

from orchestrator.chaos.rehearsed_run import RehearsedRun


class Scenario(ABC):
    """One fault that happens to a run once.

    In a rehearsal the training waits at a step during `setup`, and goes on before `fault`. Beside what a scenario
    itself asks for, the run has recovered when its training has gone beyond the step that it had reached at the fault.
    """

    @abstractmethod
    def setup(self, run: RehearsedRun) -> None:
        """Note what the run is like before, and prepare the fault.

        A fault that waits for the training to get somewhere gives its orders here: later, it may have passed there.
        """

    @abstractmethod
    def fault(self, run: RehearsedRun) -> float:
        """Do it, and return when it was done, by `RehearsedRun.now`.

        Raises:
            RunEnded: the run was over before it could happen.
        """

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether what was hit is there again."""
        return True

    @abstractmethod
    def invariant(self, run: RehearsedRun) -> None:
        """Raise `InvariantBroken` if something is otherwise than it has to be after the recovery."""
