"""Invariants after a fault, besides the comparison of whole runs."""

from collections.abc import Sequence

from orchestrator.chaos.errors import InvariantBroken
from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.heartbeat import is_alive


def require_unhurt(processes: Sequence[ProcessRecord], by: str) -> None:
    """Check that the same processes run as before.

    Raises:
        InvariantBroken: one of them has ended.
    """
    gone = [process.name for process in processes if not is_alive(process)]
    if gone:
        raise InvariantBroken(f"{', '.join(gone)} did not survive {by}")


def require_gone(process: ProcessRecord) -> None:
    """Check that a process that was replaced has ended.

    Raises:
        InvariantBroken: it still runs.
    """
    if is_alive(process):
        raise InvariantBroken(f"{process.name} was replaced, but its first process {process.pid} still runs")
