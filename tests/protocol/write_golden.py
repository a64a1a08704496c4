"""Writes a golden file of every message whose fields are in none yet: `python -m tests.protocol.write_golden`.

A golden file is what version N of the protocol put on the wire, and must decode for ever; so one that is there is never
written again, and one that no longer decodes tells of a change that breaks others, not of an old file.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from protocol.catalogue import Message
from protocol.codec import encode, seal
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Request
from protocol.messages import PROTOCOL_VERSION
from tests.protocol.values.samples import samples

GOLDEN = Path(__file__).parent / "golden"
_BODY = 2

REQUEST_HEADER = RequestHeader(request=258, incarnation="0123456789abcdef", deadline=2.5)
REPLY_HEADER = ReplyHeader(request=258, incarnation="0011223344556677", queue=0.25, compute=0.5)


def golden_files(kind: type) -> list[Path]:
    """What is there of a message in the present version: `NAME.bin`, then `NAME-2.bin` with a field more."""
    folder = GOLDEN / f"v{PROTOCOL_VERSION}"
    return sorted(path for path in folder.glob("*.bin") if path.stem.partition("-")[0] == kind.__name__)


def is_golden(message: Message) -> bool:
    """Whether a file has all the fields that the message has."""
    wanted = set(_fields(msgspec.msgpack.decode(parts_of(message)[_BODY])))
    files = (msgspec.msgpack.decode(path.read_bytes()) for path in golden_files(type(message)))
    return any(wanted <= set(_fields(msgspec.msgpack.decode(parts[_BODY]))) for parts in files)


def _fields(body: Any, path: str = "") -> Iterator[str]:
    """The names of all fields, with the way to each; a list's items count as one."""
    if isinstance(body, dict):
        for name, value in body.items():
            yield f"{path}.{name}"
            yield from _fields(value, f"{path}.{name}")
    if isinstance(body, list):
        for item in body:
            yield from _fields(item, f"{path}[]")


def parts_of(message: Message) -> list[bytes]:
    """A message's parts behind the header that all golden files have."""
    header = REQUEST_HEADER if isinstance(message, Request) else REPLY_HEADER
    return [bytes(part) for part in seal(encode(message, Limits()), header)]


def main() -> None:
    """Write what is missing: each file is a msgpack list of the message's parts."""
    for message in samples():
        if not is_golden(message):
            count = len(golden_files(type(message)))
            name = type(message).__name__ + (f"-{count + 1}" if count else "")
            path = GOLDEN / f"v{PROTOCOL_VERSION}" / f"{name}.bin"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(msgspec.msgpack.encode(parts_of(message)))


if __name__ == "__main__":
    main()
