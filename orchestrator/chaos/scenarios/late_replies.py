"""A reply after its deadline, which must not be taken for the reply to a later request."""

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.orders import carried_out
from orchestrator.chaos.scenarios.scenario import Scenario
from protocol.messages import Role

OVERDUE = 2.0
"""Seconds past its deadline."""


class LateReply(Scenario):
    """A worker answers after the deadline.

    Setup: workers of the role run.
    Fault: one of them delays a reply until the call's deadline has passed.
    Recovery: the training continues.
    Invariant: the worker still runs, since it was slow and did not hang.
    """

    def __init__(self, role: Role) -> None:
        self._role = role
        self._place = f"reply-{role.value}"

    def setup(self, run: RehearsedRun) -> None:
        """Note the workers, and order the delay of the next reply."""
        self._workers = run.children.alive(self._role)
        run.failpoints.order(self._place, f"wait {run.timeouts.call + OVERDUE:g}")

    def fault(self, run: RehearsedRun) -> float:
        """Wait for that reply."""
        return carried_out(run, self._place)

    def invariant(self, run: RehearsedRun) -> None:
        """A late reply does not cause a kill."""
        require_unhurt(self._workers, by="a late reply")
