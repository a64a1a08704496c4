"""One training at a time in a run directory: two would write over each other's journals."""

import fcntl
import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from agent.errors import RunInUse


@contextmanager
def sole_training(checkpoints: Path) -> Generator[None]:
    """Lock a run's directory of checkpoints, made if missing; the system releases the lock however the process ends.

    Raises:
        RunInUse: another process holds it.
    """
    checkpoints.mkdir(exist_ok=True)
    descriptor = os.open(checkpoints, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RunInUse(f"another process trains in {checkpoints.parent}; wait for its end") from error
        yield
    finally:
        os.close(descriptor)
