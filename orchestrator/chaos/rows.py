"""The transitions of a replay journal: rows of one size in files that are read one after the other."""

import hashlib
from collections import Counter
from pathlib import Path

from orchestrator.chaos.errors import RehearsalFailed


def row_bytes(journal: Path, rows: int) -> int:
    """Bytes of a row, of a journal that is known to have so many; 1 for an empty one.

    Raises:
        RehearsalFailed: its bytes can't be so many rows of one size.
    """
    size = sum(path.stat().st_size for path in segments(journal))
    if size == 0:
        return 1
    if rows == 0 or size % rows:
        raise RehearsalFailed(f"{journal} has {size} bytes, which are not {rows} rows of one size")
    return size // rows


def row_counts(journal: Path, size: int) -> Counter[bytes]:
    """How often each row is in the journal, by its digest; what is left of a torn row counts as one of its own."""
    counts: Counter[bytes] = Counter()
    for path in segments(journal):
        with path.open("rb") as file:
            while row := file.read(size):
                counts[hashlib.blake2b(row, digest_size=16).digest()] += 1
    return counts


def segments(journal: Path) -> list[Path]:
    """The files, in the order in which they were written."""
    return sorted(path for path in journal.rglob("*") if path.is_file())
