"""A client without any manners of its own: it sends any parts, and reads what comes back."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager

import zmq

from protocol.codec import decode, decode_header, encode, open_envelope, seal
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Reply, Request

LIMITS = Limits()
PATIENCE_MS = 10_000


class BareClient:
    """A DEALER socket."""

    def __init__(self, socket: zmq.Socket[bytes]) -> None:
        self._socket = socket

    def send(self, parts: Sequence[bytes]) -> None:
        """Send any parts."""
        self._socket.send_multipart(parts)

    def ask(self, request: Request, number: int = 1, *, deadline: float = 60.0, version: int = 1) -> None:
        """Send a request as it should be."""
        header = RequestHeader(number, "bare", deadline)
        self.send([bytes(part) for part in seal(encode(request, LIMITS), header, version)])

    def has_reply(self, seconds: float) -> bool:
        """Whether something came within so many seconds."""
        return bool(self._socket.poll(1000 * seconds))

    def receive(self) -> tuple[ReplyHeader, Reply]:
        """The next reply; an error where none comes for a long time."""
        if not self._socket.poll(PATIENCE_MS):
            raise TimeoutError("no reply")
        envelope = open_envelope(self._socket.recv_multipart(), LIMITS)
        return decode_header(envelope.header, ReplyHeader), decode(envelope, LIMITS)


@contextmanager
def bare_client(address: str) -> Generator[BareClient]:
    """A client that closes at the end, with its requests still under way."""
    with zmq.Context() as context, context.socket(zmq.DEALER) as socket:
        socket.setsockopt(zmq.LINGER, 0)
        socket.connect(address)
        yield BareClient(socket)
