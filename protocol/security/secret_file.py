"""Files whose content is a secret."""

import os
import stat
from pathlib import Path

from protocol.errors import NotPermitted

_OPEN_TO_OTHERS = stat.S_IRGRP | stat.S_IWGRP | stat.S_IROTH | stat.S_IWOTH


def read_secret(path: Path, what: str) -> bytes:
    """What is in a file that only its owner can read; `what` it is, for people.

    Raises:
        NotPermitted: others on this machine can read it.
        OSError: it can't be read.
    """
    if path.stat().st_mode & _OPEN_TO_OTHERS and not _is_mounted(path):
        raise NotPermitted(f"others on this machine can read the {what} {path}; 'chmod 600 {path}' closes it")
    return path.read_bytes()


def _is_mounted(path: Path) -> bool:
    """Whether it is a file that we could not close: a container's secret is mounted read-only, as the engine likes."""
    return not os.access(path, os.W_OK)
