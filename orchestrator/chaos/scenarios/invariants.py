"""What has to hold after a fault, beside what the comparison of whole runs shows."""

from collections.abc import Sequence

from orchestrator.chaos.errors import InvariantBroken
from orchestrator.run.run_directory import ProcessRecord
from orchestrator.supervision.heartbeat import is_alive


def require_unhurt(processes: Sequence[ProcessRecord], by: str) -> None:
    """The very processes that ran before run still.

    Raises:
        InvariantBroken: one of them is gone, whether it was replaced or not.
    """
    gone = [process.name for process in processes if not is_alive(process)]
    if gone:
        raise InvariantBroken(f"{', '.join(gone)} did not outlive {by}")


def require_gone(process: ProcessRecord) -> None:
    """A process that was replaced is not left behind.

    Raises:
        InvariantBroken: it is still there.
    """
    if is_alive(process):
        raise InvariantBroken(f"{process.name} was replaced, and its first process {process.pid} is still there")
