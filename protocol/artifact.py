"""Files that set-up makes once and every worker reads: baked bodies, background images, networks.

They live in the user's cache (`VANTAGE_CACHE` moves it), appear whole or not at all, and are refused when damaged.
"""

import errno
import hashlib
import os
import tempfile
import uuid
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import platformdirs

from protocol.errors import ArtifactDamaged, ArtifactMissing, Unavailable


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


@contextmanager
def whole_file(path: Path) -> Generator[Path]:
    """Give a path beside `path` to write to, and put it in place only when all of it is on disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.stem}.{uuid.uuid4().hex}{path.suffix}")
    try:
        yield aside
        with aside.open("rb") as written:
            os.fsync(written.fileno())
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def sha256(path: Path) -> str:
    """The file's checksum, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


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
