"""Death in the middle of a checkpoint, at every step of its writing."""

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
"""In the order in which an agent gets to them."""


class KillAtCheckpoint(Scenario):
    """An agent dies while it writes a checkpoint.

    Setup: an agent trains.
    Fault: it dies at a certain place in the writing of its next checkpoint.
    Recovery: another has its name.
    Invariant: whatever has a checkpoint's name is a whole one.
    """

    def __init__(self, place: str) -> None:
        self._place = place

    def setup(self, run: RehearsedRun) -> None:
        """Note who trains, and have it die there."""
        self._agent = run.member(Role.AGENT, 0.0)
        run.failpoints.order(self._place, "kill")

    def fault(self, run: RehearsedRun) -> float:
        """Wait for its death."""
        return carried_out(run, self._place)

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether it was replaced."""
        return run.successor(self._agent) is not None

    def invariant(self, run: RehearsedRun) -> None:
        """A checkpoint gets its name last."""
        torn = [
            path.name
            for path in (run.directory.path / "checkpoints").glob("step-*")
            if not (path / "manifest.json").is_file()
        ]
        # One that was pruned while we looked is no torn one.
        if any((run.directory.path / "checkpoints" / name).exists() for name in torn):
            raise InvariantBroken(f"{', '.join(torn)} has a checkpoint's name and no manifest")
