"""Files that set-up makes once and every worker reads: baked bodies, background images, networks.

They live in the user's cache (`VANTAGE_CACHE` moves it), appear whole or not at all, and are refused when damaged.
Whatever else is to be whole or not there is put in place by the same functions: nothing else here renames files.
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
"""Of the file that bodies are baked into; a new one has a new place."""


def cache_directory() -> Path:
    """Where artifacts are kept.

    Raises:
        Unavailable: the user has no home for a cache, and none was named.
    """
    if moved := os.environ.get("VANTAGE_CACHE"):
        return Path(moved)
    try:
        return platformdirs.user_cache_path("vantage")
    except RuntimeError as error:
        raise Unavailable("this user has no home directory; set HOME, or VANTAGE_CACHE to a directory") from error


def require_place(path: Path) -> None:
    """Try whether a file can be written at `path`, before anything is worked out for it; nothing is left behind.

    Raises:
        OSError: it can't, for the reason that it says.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    nearest = next(folder for folder in path.absolute().parents if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        # Of the file that was asked for, not of the one that was tried.
        raise OSError(error.errno, error.strerror, str(path)) from error


def bodies_path() -> Path:
    """Where the baked bodies are, unless a configuration names another place."""
    return cache_directory() / f"bodies-v{BODIES_VERSION}.npz"


@contextmanager
def whole_file(path: Path) -> Generator[Path]:
    """Give a path beside `path` to write to, and put it in place only when all of it is on disk, its name as well."""
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
    """Give a directory beside `path` to fill, and put it in place only when all that is in it is on disk.

    A directory that is not empty is never replaced; that is an OSError, and so is whatever else can't be done.
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
    """See to it that what was written to a file is on the disk."""
    with path.open("rb") as written:
        os.fsync(written.fileno())


def sync_directory(path: Path) -> None:
    """See to it that the names in a directory are on the disk, as far as its file system can."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some network file systems sync files and refuse it of directories: their names are the server's to keep.
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
    """The file's checksum; None where there is no file."""
    return sha256(path) if path.is_file() else None


def require_artifact(path: Path, *, made_by: str, checksum: str | None = None) -> Path:
    """Return `path` if it is there and, where a checksum is given, is what it should be.

    Raises:
        ArtifactMissing: it is not there; the message names the command `made_by` which it is made.
        ArtifactDamaged: its checksum is another.
    """
    if not path.is_file():
        raise ArtifactMissing(f"{path} is missing; make it with '{made_by}'")
    if checksum is not None and (found := sha256(path)) != checksum:
        raise ArtifactDamaged(f"{path} has the checksum {found[:12]}…, not {checksum[:12]}…; '{made_by}' makes it anew")
    return path
