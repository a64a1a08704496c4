"""Waiting for what is to come, with a deadline."""

import time
from collections.abc import Callable

PATIENCE = 180.0


def wait(condition: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
    """Wait until something holds.

    Raises:
        AssertionError: it did not come to that.
    """
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline, f"{what} did not come within {patience:g} s"
        time.sleep(0.1)
