"""Where a run's `ipc://` sockets live."""

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
"""Bytes that our directory's and a socket's name may take together."""
PREFIX = "vantage-"


@contextmanager
def socket_directory() -> Generator[Path]:
    """A directory that only we may enter, with a path short enough for sockets; gone at the end."""
    with (
        tempfile.TemporaryDirectory(prefix=PREFIX, dir=_parent(), ignore_cleanup_errors=True) as path,
        _spared(Path(path)),
    ):
        yield Path(path)


@contextmanager
def run_sockets(run: Path) -> Generator[Path]:
    """The directory of a run's sockets: the same one for every orchestrator of the run, gone at a clean end.

    A killed orchestrator leaves it behind, with its processes' sockets in it; the next one finds both.

    Raises:
        RunError: it can't be made, or it is not ours alone.
    """
    path = sockets_of(run)
    make_private(path)
    try:
        with _spared(path):
            yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def make_private(path: Path) -> None:
    """Have a directory that only we may enter; one that is there stays.

    Raises:
        RunError: it can't be made, or it is not ours alone.
    """
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        _require_private(path)
    except OSError as error:
        raise RunError(f"the directory {path} for sockets can't be made: {error.strerror}") from error


def sockets_of(run: Path) -> Path:
    """Where a run's sockets are: it follows from who we are and the run directory's absolute path."""
    # Its bytes, which need not be UTF-8.
    name = hashlib.sha256(b"%d:%b" % (os.geteuid(), bytes(run.resolve()))).hexdigest()[:16]
    return _parent() / f"{PREFIX}{name}"


@contextmanager
def _spared(path: Path) -> Generator[None]:
    """Have cleaners of temporary directories spare one: systemd-tmpfiles passes over what is locked, and all in it."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        # Shared, since another of our orchestrators may hold it as well; a cleaner that holds it now does so briefly.
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
    # Not followed: in a directory that everybody may write to, somebody else may have put a link there first.
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        raise RunError(f"{path} is not our directory; see whose it is, and remove it or set TMPDIR to another place")
    if stat.S_IMODE(found.st_mode) & 0o077:
        raise RunError(f"others may enter {path}; see what is in it, and remove it")
