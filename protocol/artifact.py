"""Files that set-up makes once and every worker reads: baked bodies, background images, networks.

They live in the user's cache (`VANTAGE_CACHE` moves it), appear whole or not at all, and are refused when damaged.
"""

import hashlib
import os
import uuid
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import platformdirs

from protocol.errors import ArtifactDamaged, ArtifactMissing


def cache_directory() -> Path:
    """Where artifacts are kept."""
    moved = os.environ.get("VANTAGE_CACHE")
    return Path(moved) if moved else platformdirs.user_cache_path("vantage")


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
