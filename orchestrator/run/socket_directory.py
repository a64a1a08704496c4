"""The directory of a run's `ipc://` sockets."""

import fcntl
import hashlib
import os
import shutil
import stat
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from orchestrator.errors import RunError
from protocol.text import readable
from protocol.transport.address import LONGEST_IPC_PATH

LONGEST_NAMES = 48
"""Bytes that the names of our directory and of a socket may have together."""
PREFIX = "vantage-"


@contextmanager
def socket_directory() -> Generator[Path]:
    """A private directory with a path short enough for sockets; removed afterwards."""
    with (
        tempfile.TemporaryDirectory(prefix=PREFIX, dir=_parent(), ignore_cleanup_errors=True) as path,
        _spared(Path(path)),
    ):
        yield Path(path)


@contextmanager
def run_sockets(run: Path) -> Generator[Path]:
    """The directory of a run's sockets, the same for every orchestrator of the run; removed at a clean end.

    A killed orchestrator leaves it, with its processes' sockets; the next one finds both.

    Raises:
        RunError: it can't be made, or is not private.
    """
    path = sockets_of(run)
    make_private(path)
    try:
        with _spared(path):
            yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def make_private(path: Path) -> None:
    """Make a directory that only our user may enter, unless it exists.

    Raises:
        RunError: it can't be made, or is not private.
    """
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        _require_private(path)
    except OSError as error:
        raise RunError(f"the directory {path} for sockets can't be made: {error.strerror}") from error


def sockets_of(run: Path) -> Path:
    """The path of a run's socket directory: it follows from our user and the run directory's absolute path."""
    # Its bytes, which need not be UTF-8.
    name = hashlib.sha256(b"%d:%b" % (os.geteuid(), bytes(run.resolve()))).hexdigest()[:16]
    return _parent() / f"{PREFIX}{name}"


@contextmanager
def _spared(path: Path) -> Generator[None]:
    """Lock a directory while inside, so that cleaners of /tmp spare it: systemd-tmpfiles skips locked directories."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        # Shared, since another orchestrator of ours may hold it as well. A cleaner holds it for an instant only.
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        yield
    finally:
        os.close(descriptor)


def _parent() -> Path:
    parent = Path(tempfile.gettempdir())
    # An address is sent, and is UTF-8.
    fits = len(bytes(parent)) + LONGEST_NAMES <= LONGEST_IPC_PATH and readable(str(parent)) == str(parent)
    return parent if fits else Path("/tmp")


def _require_private(path: Path) -> None:
    # Links are not followed: in a world-writable directory, another user may have put one there first.
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        raise RunError(f"{path} belongs to another user; remove it, or set TMPDIR to another place")
    if stat.S_IMODE(found.st_mode) & 0o077:
        raise RunError(f"other users may enter {path}; check its content, and remove it")
