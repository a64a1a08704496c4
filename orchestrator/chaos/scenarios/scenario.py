"""A fault scenario: Setup → Fault → Recovery → Invariant, each a method; an instance is used once."""

from abc import ABC, abstractmethod

from orchestrator.chaos.rehearsed_run import RehearsedRun


class Scenario(ABC):
    """One fault that happens to a run once.

    In a rehearsal the training waits at a step during `setup`, and continues before `fault`. The run has recovered when
    `recovered` is true and its training has passed the step that it had reached at the fault.
    """

    @abstractmethod
    def setup(self, run: RehearsedRun) -> None:
        """Note the state of the run, and prepare the fault.

        A fault at a failpoint gives its order here: later, the training may have passed the failpoint.
        """

    @abstractmethod
    def fault(self, run: RehearsedRun) -> float:
        """Cause the fault; returns its time, by `RehearsedRun.now`.

        Raises:
            RunEnded: the run ended before the fault could happen.
        """

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether the affected processes run again."""
        return True

    @abstractmethod
    def invariant(self, run: RehearsedRun) -> None:
        """Raise `InvariantBroken` if an invariant does not hold after the recovery."""
