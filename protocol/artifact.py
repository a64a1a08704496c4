"""Files that set-up makes once and every worker reads: baked bodies, background images, networks.

They live in the user's cache (`VANTAGE_CACHE` moves it), appear whole or not at all, and are refused when damaged.
Whatever else is to be whole or not there is put in place by the same functions: nothing else here renames files.
"""

import errno
import hashlib
import os
import shutil
import uuid
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import platformdirs

from protocol.errors import ArtifactDamaged, ArtifactMissing

BODIES_VERSION = 1
"""Of the file that bodies are baked into; a new one has a new place."""


def cache_directory() -> Path:
    """Where artifacts are kept."""
    moved = os.environ.get("VANTAGE_CACHE")
    return Path(moved) if moved else platformdirs.user_cache_path("vantage")


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
