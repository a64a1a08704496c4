"""Being the only one at work on a directory."""

import fcntl
import os
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from orchestrator.errors import RunBusy


@contextmanager
def directory_lock(path: Path, patience: float, otherwise: str) -> Generator[None]:
    """Hold a directory's lock; the system frees it however we end.

    Args:
        patience: seconds to wait for whoever holds it.
        otherwise: what to say when that was in vain.

    Raises:
        RunBusy: somebody else holds it.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        _lock_within(descriptor, patience, otherwise)
        yield
    finally:
        os.close(descriptor)


def _lock_within(descriptor: int, patience: float, otherwise: str) -> None:
    deadline = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise RunBusy(otherwise) from None
            time.sleep(0.05)
        else:
            return
