"""Where a run's `ipc://` sockets live."""

import hashlib
import os
import shutil
import stat
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from orchestrator.errors import RunError
from protocol.address import LONGEST_IPC_PATH
from protocol.text import readable

LONGEST_NAMES = 48
"""Bytes that our directory's and a socket's name may take together."""
PREFIX = "vantage-"


@contextmanager
def socket_directory() -> Generator[Path]:
    """A directory that only we may enter, with a path short enough for sockets; gone at the end."""
    with tempfile.TemporaryDirectory(prefix=PREFIX, dir=_parent(), ignore_cleanup_errors=True) as path:
        yield Path(path)


@contextmanager
def run_sockets(run: Path) -> Generator[Path]:
    """The directory of a run's sockets: the same one for every orchestrator of the run, gone at a clean end.

    A killed orchestrator leaves it behind, with its processes' sockets in it; the next one finds both.

    Raises:
        RunError: it can't be made, or it is not ours alone.
    """
    path = sockets_of(run)
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        _require_private(path)
    except OSError as error:
        raise RunError(f"the directory {path} for sockets can't be made: {error.strerror}") from error
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def sockets_of(run: Path) -> Path:
    """Where a run's sockets are: it follows from who we are and the run directory's absolute path."""
    # Its bytes, which need not be UTF-8.
    name = hashlib.sha256(b"%d:%b" % (os.geteuid(), bytes(run.resolve()))).hexdigest()[:16]
    return _parent() / f"{PREFIX}{name}"


def _parent() -> Path:
    parent = Path(tempfile.gettempdir())
    # An address is sent, and is UTF-8.
    fits = len(bytes(parent)) + LONGEST_NAMES <= LONGEST_IPC_PATH and readable(str(parent)) == str(parent)
    return parent if fits else Path("/tmp")


def _require_private(path: Path) -> None:
    # Not followed: in a directory that everybody may write to, somebody else may have put a link there first.
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        raise RunError(f"{path} is not our directory; see whose it is, and remove it or set TMPDIR to another place")
    if stat.S_IMODE(found.st_mode) & 0o077:
        raise RunError(f"others may enter {path}; see what is in it, and remove it")
