"""An exclusive lock on a directory."""

import fcntl
import os
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from orchestrator.errors import NoLocks, RunBusy
from protocol.system.refusal import reason


@contextmanager
def directory_lock(path: Path, patience: float, otherwise: str, called: Path | None = None) -> Generator[None]:
    """Hold a directory's lock; the system frees it when the process ends, for whatever reason.

    Args:
        patience: seconds to wait while another process holds it.
        otherwise: the message of `RunBusy`.
        called: the path to name in messages, where the directory is moved there later.

    Raises:
        RunBusy: another process holds it.
        NoLocks: its file system has no locks.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        _lock_within(called or path, descriptor, patience, otherwise)
        yield
    finally:
        os.close(descriptor)


def _lock_within(path: Path, descriptor: int, patience: float, otherwise: str) -> None:
    deadline = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise RunBusy(otherwise) from None
            time.sleep(0.05)
        except OSError as error:
            # Some network file systems know no locks (ENOSYS, ENOLCK), or none on directories (EBADF, EINVAL).
            raise NoLocks(
                f"{path} can't be locked ({reason(error)}): its file system has no locks, and two orchestrators could "
                f"work on it at once; choose a place on a local disk"
            ) from error
        else:
            return
