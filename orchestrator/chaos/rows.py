"""The transitions of a replay journal: rows of equal size in files that are read one after the other."""

import hashlib
from collections import Counter
from pathlib import Path

from orchestrator.chaos.errors import RehearsalFailed


def row_bytes(journal: Path, rows: int) -> int:
    """The bytes of a row in a journal with so many rows; 1 for an empty journal.

    Raises:
        RehearsalFailed: its size is no multiple of the number of rows.
    """
    size = sum(path.stat().st_size for path in segments(journal))
    if size == 0:
        return 1
    if rows == 0 or size % rows:
        raise RehearsalFailed(f"{journal} has {size} bytes, which are not {rows} rows of one size")
    return size // rows


def row_counts(journal: Path, size: int) -> Counter[bytes]:
    """How often each row occurs in the journal, by its digest; a torn row counts as another row."""
    counts: Counter[bytes] = Counter()
    for path in segments(journal):
        with path.open("rb") as file:
            while row := file.read(size):
                counts[hashlib.blake2b(row, digest_size=16).digest()] += 1
    return counts


def segments(journal: Path) -> list[Path]:
    """The files of a journal, in the order in which they were written."""
    return sorted(path for path in journal.rglob("*") if path.is_file())
