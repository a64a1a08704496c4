"""Files that set-up makes once and every worker reads: baked bodies, background images, networks.

They are kept in the user's cache (`VANTAGE_CACHE` moves it), are written atomically, and are refused when damaged.
All other files that have to be written atomically use the same functions; no other code renames files.
"""

import errno
import hashlib
import os
import shutil
import tempfile
import uuid
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import platformdirs

from protocol.errors import ArtifactDamaged, ArtifactMissing, Unavailable

BODIES_VERSION = 1
"""The version of the file of baked bodies, which is part of its name."""


def cache_directory() -> Path:
    """The directory of artifacts.

    Raises:
        Unavailable: the user has no home directory, and `VANTAGE_CACHE` is not set.
    """
    if moved := os.environ.get("VANTAGE_CACHE"):
        return Path(moved)
    try:
        return platformdirs.user_cache_path("vantage")
    except RuntimeError as error:
        raise Unavailable("this user has no home directory; set HOME, or VANTAGE_CACHE to a directory") from error


def require_place(path: Path) -> None:
    """Check that a file can be written at `path`, before its content is computed; leaves no file behind.

    Raises:
        OSError: it can't be written.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    nearest = next(folder for folder in path.absolute().parents if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        # With the name of the requested file in place of the temporary one's.
        raise OSError(error.errno, error.strerror, str(path)) from error


def bodies_path() -> Path:
    """The default path of the file of baked bodies."""
    return cache_directory() / f"bodies-v{BODIES_VERSION}.npz"


@contextmanager
def whole_file(path: Path) -> Generator[Path]:
    """Yield a path beside `path` to write to, and rename it to `path` once it is on disk; syncs the directory too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.stem}.{uuid.uuid4().hex}{path.suffix}")
    try:
        yield aside
        sync_file(aside)
        aside.replace(path)
        sync_directory(path.parent)
    finally:
        aside.unlink(missing_ok=True)


@contextmanager
def whole_directory(path: Path) -> Generator[Path]:
    """Yield a directory beside `path` to fill, and rename it to `path` once everything in it is on disk.

    Raises:
        OSError: `path` is a directory that is not empty, or the system refuses anything else.
    """
    aside = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
    aside.mkdir()
    try:
        yield aside
        _sync_all_in(aside)
        aside.rename(path)
        sync_directory(path.parent)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def sync_file(path: Path) -> None:
    """Flush a file to the disk."""
    with path.open("rb") as written:
        os.fsync(written.fileno())


def sync_directory(path: Path) -> None:
    """Flush the names in a directory to the disk, if its file system can."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some network file systems sync files only; their servers keep the names.
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)


def _sync_all_in(directory: Path) -> None:
    for path in directory.iterdir():
        if path.is_dir():
            _sync_all_in(path)
        else:
            sync_file(path)
    sync_directory(directory)


def sha256(path: Path) -> str:
    """The file's checksum, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def checksum_if_there(path: Path) -> str | None:
    """The file's checksum; None if there is no file."""
    return sha256(path) if path.is_file() else None


def require_artifact(path: Path, *, made_by: str, checksum: str | None = None) -> Path:
    """Return `path` if the file exists and has the checksum, where one is given.

    Args:
        made_by: the command that makes the file, for messages.

    Raises:
        ArtifactMissing: the file does not exist.
        ArtifactDamaged: it has another checksum.
    """
    if not path.is_file():
        raise ArtifactMissing(f"{path} is missing; make it with '{made_by}'")
    if checksum is not None and (found := sha256(path)) != checksum:
        raise ArtifactDamaged(f"{path} has the checksum {found[:12]}…, not {checksum[:12]}…; '{made_by}' makes it anew")
    return path
