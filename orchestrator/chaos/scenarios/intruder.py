"""Somebody at a worker's socket who does not speak its language: with ZeroMQ, and with bare bytes."""

import contextlib
import random
import socket
import struct
from collections.abc import Iterator

import zmq

from protocol.limits import DEFAULT_LIMITS, MIB
from protocol.transport.address import ipc_path

PATIENCE = 0.2
"""Seconds of silence after which nothing more is expected of the other side."""
LINGER_MS = 5000
GREETING = b"\xff" + bytes(8) + b"\x7f" + bytes((3, 1)) + b"NULL".ljust(20, b"\0") + bytes(32)
"""How a ZMTP 3.1 connection without keys begins."""
_ABOUT = b"\x05READY" + b"\x0bSocket-Type" + struct.pack(">I", 6) + b"DEALER"
READY = bytes((4, len(_ABOUT))) + _ABOUT
LONG_FRAME = b"\x02"
PRELUDE = struct.pack("<HH", 1, 18)
"""A `Render` of version 1."""


def garbage_messages(rng: random.Random) -> Iterator[list[bytes]]:
    """Multiparts that are no messages: empty, too short, random, and right but for a part."""
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
    """What a stranger may say to the bare socket, piece by piece: nothing we know, and handshakes that go wrong."""
    yield (rng.randbytes(4096),)
    yield (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",)
    yield (GREETING[:20],)
    yield GREETING, rng.randbytes(4096)
    yield GREETING, READY, rng.randbytes(4096)


def oversized_talks() -> Iterator[tuple[bytes, ...]]:
    """A frame that is announced as larger than any memory."""
    yield GREETING, READY, LONG_FRAME + struct.pack(">Q", 2**62) + bytes(4096)


def send_messages(address: str, messages: Iterator[list[bytes]]) -> None:
    """Each message on a connection of its own, since the other side may end it; nobody listens for answers."""
    with zmq.Context() as context:
        for message in messages:
            with context.socket(zmq.DEALER) as dealer:
                dealer.set(zmq.LINGER, LINGER_MS)
                dealer.connect(address)
                dealer.send_multipart(message)


def talk(address: str, talks: Iterator[tuple[bytes, ...]]) -> None:
    """Each on a connection of its own; between two pieces the other side may answer, or hang up."""
    for pieces in talks:
        with contextlib.suppress(OSError), _connected(address) as stranger:
            for piece in pieces:
                stranger.sendall(piece)
                _listen(stranger)


def _listen(stranger: socket.socket) -> None:
    # ZeroMQ ends a connection on which a message comes before it has said itself that it is ready.
    with contextlib.suppress(TimeoutError):
        while stranger.recv(4096):
            continue


def _connected(address: str) -> socket.socket:
    path = ipc_path(address)
    if path is not None:
        stranger = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        stranger.settimeout(PATIENCE)
        stranger.connect(str(path))
        return stranger
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    return socket.create_connection((host.strip("[]"), int(port)), timeout=PATIENCE)
