"""A worker without any manners of its own, for the programs beside this one to misbehave with.

Each of them is named for its sin and is started with an address: `python never_answers.py ipc:///tmp/address`.
"""

import sys
from collections.abc import Callable

import zmq

from protocol.catalogue import Message
from protocol.codec import decode, decode_header, encode, open_envelope, seal
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Reply
from protocol.messages import Hello, Ping, Pong, Role, State, Welcome

INCARNATION = "bare"
LIMITS = Limits()


class BareWorker:
    """A ROUTER socket that is served in one thread, one message after the other."""

    def __init__(self, address: str) -> None:
        self.socket = zmq.Context.instance().socket(zmq.ROUTER)
        self.socket.bind(address)

    def receive(self) -> tuple[bytes, int, Message]:
        """The next message: who sent it, the id of the request, and what it says."""
        sender, *parts = self.socket.recv_multipart()
        envelope = open_envelope(parts, LIMITS)
        return sender, decode_header(envelope.header, RequestHeader).request, decode(envelope, LIMITS)

    def reply(self, sender: bytes, number: int, reply: Reply, *, incarnation: str = INCARNATION) -> None:
        """Answer a request."""
        self.socket.send_multipart([sender, *seal(encode(reply, LIMITS), ReplyHeader(number, incarnation))])

    def serve(self, answer: Callable[["BareWorker", bytes, int, Message], None]) -> None:
        """Greet and answer pings as one should; leave the rest to `answer`."""
        while True:
            sender, number, message = self.receive()
            match message:
                case Hello():
                    self.reply(sender, number, welcome())
                case Ping():
                    self.reply(sender, number, pong())
                case _:
                    answer(self, sender, number, message)


def welcome(role: Role = Role.RENDER, version: int = 1) -> Welcome:
    """A welcome as it should be."""
    return Welcome(version=version, role=role, incarnation=INCARNATION, heartbeat=0.1)


def pong() -> Pong:
    """A pong of a worker that is ready."""
    return Pong(incarnation=INCARNATION, state=State.READY, progress=0, queue_depth=0, resident_bytes=1)


def open_worker() -> BareWorker:
    """The worker at the address on the command line."""
    return BareWorker(sys.argv[1])
