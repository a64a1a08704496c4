"""Waits for orders to failpoints, while the run is polled."""

from orchestrator.chaos.rehearsed_run import RehearsedRun


def carried_out(run: RehearsedRun, place: str) -> float:
    """Wait until a process has reached a failpoint with an order; returns the time.

    Raises:
        RunEnded: the run ended before.
    """
    try:
        run.wait(lambda: not run.failpoints.is_pending(place), f"a process reached {place}")
    finally:
        run.failpoints.cancel(place)
    return run.now()
