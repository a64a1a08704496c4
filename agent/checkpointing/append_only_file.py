"""An append-only file, whose length identifies its content at a moment.

Added data waits in memory until it is written, and stays there if the disk has no room for it. So a full disk loses
nothing, and no half-written data is left behind.
"""

import contextlib
import hashlib
import os
from pathlib import Path

from msgspec import Struct

from agent.errors import JournalDamaged
from protocol.artifact import sha256

_CHUNK = 1 << 20


class FileMark(Struct, frozen=True):
    """A file as it was at a moment: its length in bytes, and the checksum of that much of it."""

    length: int
    sha256: str


class AppendOnlyFile:
    """Open for appending; content past `length` bytes is cut off. Every error of the disk is an OSError."""

    def __init__(self, path: Path, length: int = 0) -> None:
        self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        os.ftruncate(self._descriptor, length)
        self._written = length
        self._digest = _digest_of(path, length)
        self._waiting: list[bytes] = []
        self._length = length

    @property
    def mark(self) -> FileMark:
        """The mark of the written part."""
        return FileMark(length=self._written, sha256=self._digest.hexdigest())

    @property
    def length(self) -> int:
        """Bytes, with those that wait in memory."""
        return self._length

    def add(self, data: bytes) -> None:
        """Keep for writing."""
        self._waiting.append(data)
        self._length += len(data)

    def write(self) -> None:
        """Write the waiting data, so that readers see it; all of it or, with an OSError, nothing."""
        data = b"".join(self._waiting)
        try:
            _write_at(self._descriptor, data, self._written)
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self._written)
            raise
        self._written += len(data)
        self._digest.update(data)
        self._waiting.clear()

    def sync(self) -> None:
        """Write the waiting data, and sync it to the disk."""
        self.write()
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Close the file; waiting data is dropped."""
        os.close(self._descriptor)


def require_intact(path: Path, mark: FileMark) -> None:
    """Make sure that a file begins with the marked content; it may have grown since.

    Raises:
        JournalDamaged: it is missing, shorter, or begins otherwise.
    """
    if not path.is_file():
        raise JournalDamaged(f"{path} is missing; the training can't go on without it")
    if (length := path.stat().st_size) < mark.length:
        raise JournalDamaged(f"{path} has {length} bytes of {mark.length}; the training can't go on without the rest")
    if _digest_of(path, mark.length).hexdigest() != mark.sha256:
        raise JournalDamaged(f"{path} is not what was written; the training can't go on from it")


def mark_of(path: Path) -> FileMark:
    """The mark of a whole file."""
    return FileMark(length=path.stat().st_size, sha256=sha256(path))


def mark_of_bytes(data: bytes) -> FileMark:
    """The mark of a file with this content."""
    return FileMark(length=len(data), sha256=hashlib.sha256(data).hexdigest())


def _write_at(descriptor: int, data: bytes, offset: int) -> None:
    rest = memoryview(data)
    while rest:
        written = os.pwrite(descriptor, rest, offset)
        rest, offset = rest[written:], offset + written


def _digest_of(path: Path, length: int) -> "hashlib._Hash":
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while length > 0 and (data := file.read(min(length, _CHUNK))):
            digest.update(data)
            length -= len(data)
    return digest
