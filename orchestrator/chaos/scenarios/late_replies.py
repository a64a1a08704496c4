"""A reply that comes when its caller has given up: it must not be taken for the next one's."""

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.orders import carried_out
from orchestrator.chaos.scenarios.scenario import Scenario
from protocol.messages import Role

OVERDUE = 2.0
"""Seconds past its deadline."""


class LateReply(Scenario):
    """A worker answers too late.

    Setup: workers of the role run.
    Fault: one of them holds a reply back until the call's deadline has passed.
    Recovery: the training goes on.
    Invariant: the worker, which was slow and did not hang, still runs.
    """

    def __init__(self, role: Role) -> None:
        self._role = role
        self._place = f"reply-{role.value}"

    def setup(self, run: RehearsedRun) -> None:
        """Note who is there, and have the next reply held back."""
        self._workers = run.children.alive(self._role)
        run.failpoints.order(self._place, f"wait {run.timeouts.call + OVERDUE:g}")

    def fault(self, run: RehearsedRun) -> float:
        """Wait for that reply."""
        return carried_out(run, self._place)

    def invariant(self, run: RehearsedRun) -> None:
        """Being late is no reason to be killed."""
        require_unhurt(self._workers, by="a late reply")
