"""Files of JSON lines that a process appends to while another reads them."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import msgspec
from msgspec import Struct

from protocol.text import UNDECODABLE, json_of

TAIL = 64 * 1024
"""Bytes at the end of a file in which its last lines are searched."""

RecordT = TypeVar("RecordT", bound=Struct)


def last_lines(path: Path, start: int = 0) -> list[bytes]:
    """The last non-empty lines at or after byte `start`, the last one first; none if there is no file."""
    try:
        with path.open("rb") as file:
            file.seek(max(start, file.seek(0, os.SEEK_END) - TAIL))
            return [line for line in reversed(file.read().splitlines()) if line.strip()]
    except OSError:
        return []


def last_record(path: Path, record: type[RecordT]) -> RecordT | None:
    """The last line that is a whole record; a line that is still being written is skipped."""
    for line in last_lines(path):
        try:
            return msgspec.json.decode(line, type=record)
        except UNDECODABLE:
            continue
    return None


def all_records(path: Path, record: type[RecordT]) -> Iterator[RecordT]:
    """Every line that is a whole record; none if there is no file."""
    for line in Follower(path).new_lines():
        with suppress(*UNDECODABLE):
            yield msgspec.json.decode(line, type=record)


def append_record(path: Path, record: Struct) -> None:
    """Append a line, in one write, so that a reader never sees part of it."""
    with path.open("ab", buffering=0) as file:
        file.write(json_of(record) + b"\n")


class Follower:
    """Reads the lines that were appended to a file since the last call."""

    def __init__(self, path: Path, start: int = 0) -> None:
        self._path = path
        self._position = start

    def new_lines(self) -> Iterator[bytes]:
        """The new whole lines; a line that is still being written comes with the next call."""
        try:
            with self._path.open("rb") as file:
                file.seek(self._position)
                added = file.read()
        except OSError:
            return
        whole = added.rfind(b"\n") + 1
        self._position += whole
        yield from added[:whole].splitlines()
