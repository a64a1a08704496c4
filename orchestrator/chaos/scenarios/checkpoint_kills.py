"""A kill of the agent while it writes a checkpoint, at every step of the writing."""

from orchestrator.chaos.errors import InvariantBroken
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.orders import carried_out
from orchestrator.chaos.scenarios.scenario import Scenario
from protocol.messages import Role

PLACES = (
    "checkpoint-opened",
    "checkpoint-journal-synced",
    "checkpoint-written",
    "checkpoint-manifest-written",
    "checkpoint-renamed",
    "checkpoint-pruned",
)
"""In the order in which an agent reaches them."""


class KillAtCheckpoint(Scenario):
    """An agent is killed while it writes a checkpoint.

    Setup: an agent trains.
    Fault: it is killed at a certain point of writing its next checkpoint.
    Recovery: the agent was replaced.
    Invariant: every directory with a checkpoint's name is a whole checkpoint.
    """

    def __init__(self, place: str) -> None:
        self._place = place

    def setup(self, run: RehearsedRun) -> None:
        """Note the agent, and order its kill there."""
        self._agent = run.member(Role.AGENT, 0.0)
        run.failpoints.order(self._place, "kill")

    def fault(self, run: RehearsedRun) -> float:
        """Wait for the kill."""
        return carried_out(run, self._place)

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether it was replaced."""
        return run.successor(self._agent) is not None

    def invariant(self, run: RehearsedRun) -> None:
        """Every checkpoint is whole, since it gets its name last."""
        torn = [
            path.name
            for path in (run.directory.path / "checkpoints").glob("step-*")
            if not (path / "manifest.json").is_file()
        ]
        # A checkpoint that was pruned meanwhile is not torn.
        if any((run.directory.path / "checkpoints" / name).exists() for name in torn):
            raise InvariantBroken(f"{', '.join(torn)} has a checkpoint's name and no manifest")
