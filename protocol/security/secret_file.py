"""Files with secret content."""

import os
import stat
from pathlib import Path

from protocol.errors import NotPermitted

_OPEN_TO_OTHERS = stat.S_IRGRP | stat.S_IWGRP | stat.S_IROTH | stat.S_IWOTH


def read_secret(path: Path, what: str) -> bytes:
    """The content of a file that only its owner can read.

    Args:
        what: the file's content, for messages, such as `key`.

    Raises:
        NotPermitted: other users of this machine can read it.
        OSError: it can't be read.
    """
    if path.stat().st_mode & _OPEN_TO_OTHERS and not _is_mounted(path):
        raise NotPermitted(f"others on this machine can read the {what} {path}; 'chmod 600 {path}' closes it")
    return path.read_bytes()


def _is_mounted(path: Path) -> bool:
    """Whether this process can't change the file's mode: a container engine mounts secrets read-only."""
    return not os.access(path, os.W_OK)
