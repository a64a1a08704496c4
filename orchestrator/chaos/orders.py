"""Orders to failpoints, carried out while we watch."""

from orchestrator.chaos.rehearsed_run import RehearsedRun


def carried_out(run: RehearsedRun, place: str, what: str) -> float:
    """Have the next process at a place do something, and return when it did.

    Raises:
        RunEnded: nobody got there any more.
    """
    run.failpoints.order(place, what)
    try:
        run.wait(lambda: not run.failpoints.is_pending(place), f"anyone came to {place}")
    finally:
        run.failpoints.cancel(place)
    return run.now()
