"""Where a run's `ipc://` sockets live."""

import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from protocol.address import LONGEST_IPC_PATH

LONGEST_NAMES = 48
"""Bytes that our directory's and a socket's name may take together."""


@contextmanager
def socket_directory() -> Generator[Path]:
    """A directory that only we may enter, with a path short enough for sockets; gone at the end."""
    parent = Path(tempfile.gettempdir())
    if len(bytes(parent)) + LONGEST_NAMES > LONGEST_IPC_PATH:
        parent = Path("/tmp")
    with tempfile.TemporaryDirectory(prefix="vantage-", dir=parent, ignore_cleanup_errors=True) as path:
        yield Path(path)
