"""An intruder at a worker's socket: sends garbage and oversized messages by ZeroMQ, and bytes by a bare socket."""

import contextlib
import random
import socket
import struct
from collections.abc import Iterator

import zmq

from protocol.limits import DEFAULT_LIMITS, MIB
from protocol.transport.address import ipc_path

PATIENCE = 0.2
"""Seconds to wait for bytes of the other side."""
LINGER_MS = 5000
GREETING = b"\xff" + bytes(8) + b"\x7f" + bytes((3, 1)) + b"NULL".ljust(20, b"\0") + bytes(32)
"""How a ZMTP 3.1 connection without keys begins."""
_ABOUT = b"\x05READY" + b"\x0bSocket-Type" + struct.pack(">I", 6) + b"DEALER"
READY = bytes((4, len(_ABOUT))) + _ABOUT
LONG_FRAME = b"\x02"
PRELUDE = struct.pack("<HH", 1, 18)
"""A `Render` of version 1."""


def garbage_messages(rng: random.Random) -> Iterator[list[bytes]]:
    """Multiparts that are not messages: empty, too short, random, and valid except for one part."""
    yield [b""]
    yield [PRELUDE]
    yield [b"", b"", b""]
    yield [PRELUDE, b"\xc1", b"\x80"]
    yield [PRELUDE, b'{"request": 1}', b"\x80"]
    for _ in range(16):
        yield [rng.randbytes(rng.choice((1, 4, 40, 4000))) for _ in range(rng.randint(1, 12))]


def oversized_messages() -> Iterator[list[bytes]]:
    """One for each limit: header, body, array, and number of parts."""
    yield [PRELUDE, bytes(DEFAULT_LIMITS.header_bytes + 1), b"\x80"]
    yield [PRELUDE, b"\x80", bytes(DEFAULT_LIMITS.body_bytes + 1)]
    yield [PRELUDE, b"\x80", b"\x80", *[b"\0"] * (DEFAULT_LIMITS.parts + 50)]
    yield [PRELUDE, b"\x80", b"\x80", bytes(DEFAULT_LIMITS.part_bytes + MIB)]


def garbage_talks(rng: random.Random) -> Iterator[tuple[bytes, ...]]:
    """Bytes for the bare socket, piece by piece: no known protocol, and handshakes that go wrong."""
    yield (rng.randbytes(4096),)
    yield (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",)
    yield (GREETING[:20],)
    yield GREETING, rng.randbytes(4096)
    yield GREETING, READY, rng.randbytes(4096)


def oversized_talks() -> Iterator[tuple[bytes, ...]]:
    """A frame that is announced as larger than any memory."""
    yield GREETING, READY, LONG_FRAME + struct.pack(">Q", 2**62) + bytes(4096)


def send_messages(address: str, messages: Iterator[list[bytes]]) -> None:
    """Send each message on a connection of its own, since the other side may close it; replies are not read."""
    with zmq.Context() as context:
        for message in messages:
            with context.socket(zmq.DEALER) as dealer:
                dealer.set(zmq.LINGER, LINGER_MS)
                dealer.connect(address)
                dealer.send_multipart(message)


def talk(address: str, talks: Iterator[tuple[bytes, ...]]) -> None:
    """Send each on a connection of its own; between two pieces the other side may answer, or close the connection."""
    for pieces in talks:
        with contextlib.suppress(OSError), _connected(address) as intruder:
            for piece in pieces:
                intruder.sendall(piece)
                _listen(intruder)


def _listen(intruder: socket.socket) -> None:
    # ZeroMQ closes a connection on which a message comes before its own READY.
    with contextlib.suppress(TimeoutError):
        while intruder.recv(4096):
            continue


def _connected(address: str) -> socket.socket:
    path = ipc_path(address)
    if path is not None:
        intruder = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        intruder.settimeout(PATIENCE)
        intruder.connect(str(path))
        return intruder
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    return socket.create_connection((host.strip("[]"), int(port)), timeout=PATIENCE)
