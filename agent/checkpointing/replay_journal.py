"""Every step that an off-policy learner has observed, in order, in append-only files.

A step of all drones is a row of fixed size. A checkpoint names the journal by its segments' lengths and checksums, at
the same cost for any size; the replay memory is the end of the journal, and is filled from there.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from agent.checkpointing.append_only_file import AppendOnlyFile, FileMark, require_intact
from agent.environment.spaces import ACTION_SIZE
from agent.learning.learner import Transition
from protocol.artifact import sync_directory

SEGMENT_BYTES = 64 * 1024**2


class Segment(Struct, frozen=True):
    """One file of the journal, as it was at a moment."""

    name: str
    mark: FileMark


def row_type(drones: int, observation_size: int) -> np.dtype[Any]:
    """A step of `drones` drones as stored in the files: little-endian, without gaps."""
    one = {
        "observations": ("<f4", (observation_size,)),
        "actions": ("<f4", (ACTION_SIZE,)),
        "rewards": ("<f8", ()),
        "next_observations": ("<f4", (observation_size,)),
        "terminated": ("?", ()),
        "truncated": ("?", ()),
    }
    return np.dtype([(name, kind, (drones, *shape)) for name, (kind, shape) in one.items()])


def require_segments(directory: Path, segments: Sequence[Segment]) -> None:
    """Make sure that the journal begins with these segments.

    Raises:
        JournalDamaged: one of them is missing, shorter, or begins otherwise.
    """
    for segment in segments:
        require_intact(directory / segment.name, segment.mark)


class ReplayJournal:
    """Open for appending; content after `segments` is removed."""

    def __init__(
        self,
        directory: Path,
        drones: int,
        observation_size: int,
        segments: Sequence[Segment] = (),
        *,
        segment_bytes: int = SEGMENT_BYTES,
    ) -> None:
        directory.mkdir(exist_ok=True)
        self._directory = directory
        self._type = row_type(drones, observation_size)
        self._segment_bytes = max(segment_bytes, self._type.itemsize)
        self._finished = list(segments[:-1])
        self._open: list[tuple[str, AppendOnlyFile]] = []
        kept = {segment.name for segment in segments}
        for path in directory.iterdir():
            if path.name not in kept:
                path.unlink()
        self._begin(segments[-1].mark.length if segments else 0)

    def append(self, transition: Transition) -> None:
        """Add a step of every drone; it is on the disk after the next `sync`."""
        row = np.empty(1, self._type)
        for name in self._type.names or ():
            row[name] = getattr(transition, name)
        if self._open[-1][1].length + row.nbytes > self._segment_bytes:
            self._begin(0)
        self._open[-1][1].add(row.tobytes())

    def sync(self) -> tuple[Segment, ...]:
        """Sync all of it to the disk; returns the segments.

        Raises:
            OSError: for example, the disk is full; unwritten rows are kept for the next time.
        """
        while len(self._open) > 1:
            name, file = self._open[0]
            file.sync()
            self._finished.append(Segment(name, file.mark))
            self._open.pop(0)
            file.close()
        name, file = self._open[0]
        file.sync()
        sync_directory(self._directory)
        return (*self._finished, Segment(name, file.mark))

    def last(self, steps: int) -> Iterator[Transition]:
        """The last steps that were synced, oldest first, a segment's at a time: arrays (k, drones, …)."""
        segments = [*self._finished, *(Segment(name, file.mark) for name, file in self._open)]
        rows = [segment.mark.length // self._type.itemsize for segment in segments]
        skipped = sum(rows) - steps
        for segment, count in zip(segments, rows, strict=True):
            first = min(max(skipped, 0), count)
            skipped -= count
            if first < count:
                path, offset = self._directory / segment.name, first * self._type.itemsize
                yield _transition(np.fromfile(path, self._type, count=count - first, offset=offset))

    def close(self) -> None:
        """Close the files; rows that were not synced are dropped."""
        for _, file in self._open:
            file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _begin(self, length: int) -> None:
        """Open the next segment, which has `length` bytes already."""
        name = f"{len(self._finished) + len(self._open):06d}.bin"
        self._open.append((name, AppendOnlyFile(self._directory / name, length)))


def _transition(rows: NDArray[Any]) -> Transition:
    return Transition(**{name: rows[name] for name in rows.dtype.names or ()})
