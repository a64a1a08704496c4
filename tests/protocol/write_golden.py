"""Writes the golden file of every message that has none yet: `python -m tests.protocol.write_golden`.

A golden file is what version N of the protocol put on the wire, and must decode for ever; so one that is there is never
written again, and one that no longer decodes tells of a change that breaks others, not of an old file.
"""

from pathlib import Path

import msgspec

from protocol.catalogue import Message
from protocol.codec import encode, seal
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Request
from protocol.messages import PROTOCOL_VERSION
from tests.protocol.samples import samples

GOLDEN = Path(__file__).parent / "golden"

REQUEST_HEADER = RequestHeader(request=258, incarnation="0123456789abcdef", deadline=2.5)
REPLY_HEADER = ReplyHeader(request=258, incarnation="0011223344556677", queue=0.25, compute=0.5)


def golden_path(kind: type) -> Path:
    """Where the file of a message of the present version is."""
    return GOLDEN / f"v{PROTOCOL_VERSION}" / f"{kind.__name__}.bin"


def parts_of(message: Message) -> list[bytes]:
    """A message's parts behind the header that all golden files have."""
    header = REQUEST_HEADER if isinstance(message, Request) else REPLY_HEADER
    return [bytes(part) for part in seal(encode(message, Limits()), header)]


def main() -> None:
    """Write what is missing: each file is a msgpack list of the message's parts."""
    for message in samples():
        path = golden_path(type(message))
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(msgspec.msgpack.encode(parts_of(message)))


if __name__ == "__main__":
    main()
