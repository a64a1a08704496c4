"""Orders to failpoints, waited for while we watch the run."""

from orchestrator.chaos.rehearsed_run import RehearsedRun


def carried_out(run: RehearsedRun, place: str) -> float:
    """Wait until a process was at the place that something was ordered for, and return when it was.

    Raises:
        RunEnded: nobody got there any more.
    """
    try:
        run.wait(lambda: not run.failpoints.is_pending(place), f"anyone came to {place}")
    finally:
        run.failpoints.cancel(place)
    return run.now()
