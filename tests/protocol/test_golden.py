"""What every past version wrote is still read, and means the same. `write_golden.py` says how a file is made."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from protocol.codec import decode, decode_header, open_envelope
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Request
from protocol.messages import MESSAGE_NUMBERS
from tests.protocol.values.samples import samples
from tests.protocol.write_golden import GOLDEN, REPLY_HEADER, REQUEST_HEADER, golden_files, is_golden, parts_of

LIMITS = Limits()
FILES = sorted(GOLDEN.glob("v*/*.bin"))


def parts_in(path: Path) -> list[bytes]:
    return msgspec.msgpack.decode(path.read_bytes(), type=list[bytes])


def says_all_of(new: Any, old: Any) -> bool:
    """Whether `new` has every field of `old` with the same value; it may have more."""
    if isinstance(old, dict):
        return isinstance(new, dict) and all(key in new and says_all_of(new[key], old[key]) for key in old)
    if isinstance(old, list):
        return isinstance(new, list) and len(new) == len(old) and all(map(says_all_of, new, old))
    return type(new) is type(old) and new == old


def test_every_message_has_a_golden_file():
    assert [kind for kind in MESSAGE_NUMBERS if not golden_files(kind)] == []


def test_every_field_is_in_a_golden_file():
    assert [type(message).__name__ for message in samples() if not is_golden(message)] == []


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_golden_file_is_read_and_loses_nothing(path):
    envelope = open_envelope(parts_in(path), LIMITS)
    message = decode(envelope, LIMITS)
    assert type(message).__name__ == path.stem.partition("-")[0]
    again = open_envelope(parts_of(message), LIMITS)
    assert again.number == envelope.number
    assert says_all_of(msgspec.msgpack.decode(again.body), msgspec.msgpack.decode(envelope.body))
    assert list(map(bytes, again.arrays[: len(envelope.arrays)])) == list(envelope.arrays)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_golden_header_is_read(path):
    envelope = open_envelope(parts_in(path), LIMITS)
    if isinstance(decode(envelope, LIMITS), Request):
        assert decode_header(envelope.header, RequestHeader) == REQUEST_HEADER
    else:
        assert decode_header(envelope.header, ReplyHeader) == REPLY_HEADER


def test_a_field_that_is_taken_away_or_renamed_is_noticed():
    old = {"seed": 1, "camera": {"pose": [0, 1]}}
    assert says_all_of(old | {"added": None}, old)
    assert not says_all_of({"seed": 1}, old)
    assert not says_all_of({"seed": 1.0, "camera": {"pose": [0, 1]}}, old)
    assert not says_all_of({"seed": 1, "camera": {"pose": [0, 2]}}, old)


def test_golden_files_are_small():
    assert sum(path.stat().st_size for path in FILES) < 100_000
