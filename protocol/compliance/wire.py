"""A connection to the worker under test that sends any bytes, and returns everything that comes back."""

import itertools
import math
import time
from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

import msgspec
import zmq
from msgspec import Struct
from zmq.utils.monitor import recv_monitor_message

from protocol.catalogue import Message
from protocol.codec import decode, decode_header, encode, open_envelope, seal
from protocol.errors import DeadlineExceeded, MalformedMessage
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import DEFAULT_LIMITS
from protocol.message import Request
from protocol.messages import PROTOCOL_VERSION, Failure, Ping, Pong
from protocol.transport.sockets import Context, Socket

INCARNATION = "compliance"
DEADLINE = 120.0
"""Seconds; the deadline of requests in tests that are not about deadlines."""


class Answer(Struct, frozen=True, eq=False):
    """A reply and its header."""

    version: int
    header: ReplyHeader
    message: Message


class Wire:
    """A DEALER socket; the ids of its requests count from 1."""

    def __init__(self, socket: Socket, monitor: Socket, patience: float) -> None:
        self._socket = socket
        self._monitor = monitor
        self._patience = patience
        self._numbers = itertools.count(1)
        self._early: list[Answer] = []

    def next_number(self) -> int:
        """An id that no request on this connection had before."""
        return next(self._numbers)

    def send(self, parts: Sequence[bytes]) -> None:
        """Send any parts."""
        self._socket.send_multipart(parts)

    def ask(self, request: Request[Any], number: int | None = None, *, deadline: float = DEADLINE) -> int:
        """Send a correct request; returns its id."""
        number = self.next_number() if number is None else number
        self.send(parts_of(request, number, deadline=deadline))
        return number

    def receive(self, awaited: str = "a reply") -> Answer:
        """The next reply, to any request.

        Raises:
            DeadlineExceeded: no reply came.
            ProtocolError: the reply can't be decoded.
        """
        if self._early:
            return self._early.pop(0)
        if not self._socket.poll(math.ceil(self._patience * 1000)):
            raise DeadlineExceeded(f"waited {self._patience:g} s for {awaited}, nothing came")
        envelope = open_envelope(self._socket.recv_multipart(), DEFAULT_LIMITS)
        header = decode_header(envelope.header, ReplyHeader)
        return Answer(envelope.version, header, decode(envelope, DEFAULT_LIMITS))

    def answers(self, numbers: Collection[int], awaited: str = "a reply") -> list[Answer]:
        """The replies to these requests, in the order in which they came; replies to others are kept for later.

        Raises:
            DeadlineExceeded: one did not come.
            MalformedMessage: a request was answered twice.
        """
        missing, found, others = set(numbers), list[Answer](), list[Answer]()
        while missing:
            answer = self.receive(f"{awaited} ({len(missing)} of {len(numbers)} missing)")
            if answer.header.request in missing:
                missing.remove(answer.header.request)
                found.append(answer)
            elif answer.header.request in numbers:
                raise MalformedMessage(f"request {answer.header.request} was answered twice")
            else:
                others.append(answer)
        self._early = others
        return found

    def answer(self, number: int, awaited: str = "a reply") -> Answer:
        """The reply to one request."""
        return self.answers([number], awaited)[0]

    def call(self, request: Request[Any], *, deadline: float = DEADLINE) -> Message:
        """Send a request, and return the reply."""
        return self.answer(self.ask(request, deadline=deadline), f"the answer to {type(request).__name__}").message

    def ping(self) -> Pong:
        """The worker's state.

        Raises:
            MalformedMessage: the reply to a ping was not a pong.
        """
        pong = self.call(Ping())
        if not isinstance(pong, Pong):
            raise MalformedMessage(f"Ping was answered by {pong}")
        return pong

    def answers_before_a_ping(self) -> list[Answer]:
        """The replies that come before the one to a ping sent now."""
        number, seen = self.ask(Ping()), list[Answer]()
        while not seen or seen[-1].header.request != number:
            seen.append(self.receive("the answer to Ping"))
        return seen[:-1]

    def refusal(self) -> Failure | None:
        """The first reply, if it is a Failure; None if the worker ends the connection instead.

        Raises:
            DeadlineExceeded: neither happened.
            MalformedMessage: the reply is not a Failure.
        """
        poller = zmq.Poller()
        poller.register(self._socket, zmq.POLLIN)
        poller.register(self._monitor, zmq.POLLIN)
        ready = dict(poller.poll(math.ceil(self._patience * 1000)))
        if self._socket in ready:
            message = self.receive().message
            if isinstance(message, Failure):
                return message
            raise MalformedMessage(f"answered by {type(message).__name__}")
        if not ready:
            raise DeadlineExceeded(f"waited {self._patience:g} s for a Failure or the connection's end; neither came")
        recv_monitor_message(self._monitor)
        return None

    def wait_for_the_end(self) -> None:
        """Return once the worker has ended this connection.

        Raises:
            DeadlineExceeded: it did not.
        """
        if not self._monitor.poll(math.ceil(self._patience * 1000)):
            raise DeadlineExceeded(f"waited {self._patience:g} s for the worker to end; it is still connected")

    def close(self) -> None:
        """Close the connection, and drop the requests under way."""
        if not self._socket.closed:
            self._socket.disable_monitor()
            self._monitor.close()
            self._socket.close()

    def wait_until(self, holds: Callable[[Pong], bool], *, seconds: float | None = None, pause: float = 0.05) -> Pong:
        """The first pong for which `holds`.

        Raises:
            DeadlineExceeded: there was none within `seconds`, by default the suite's patience.
        """
        seconds = self._patience if seconds is None else seconds
        end = time.monotonic() + seconds
        while not holds(pong := self.ping()):
            if time.monotonic() > end:
                raise DeadlineExceeded(f"after {seconds:g} s the worker is still {pong}")
            time.sleep(pause)
        return pong


Connect: TypeAlias = Callable[[], Wire]
"""Opens a connection for as long as a test lasts."""


@contextmanager
def connected(context: Context, address: str, patience: float) -> Generator[Wire]:
    """A new connection; requests under way when it closes are dropped."""
    socket = context.socket(zmq.DEALER)
    socket.set(zmq.LINGER, 0)
    socket.set(zmq.IPV6, int("[" in address))
    # Before connecting: the monitor does not report a connection that is older than itself.
    wire = Wire(socket, socket.get_monitor_socket(zmq.EVENT_DISCONNECTED), patience)
    try:
        socket.connect(address)
        yield wire
    finally:
        wire.close()


def parts_of(
    request: Message, number: int, *, deadline: float = DEADLINE, version: int = PROTOCOL_VERSION
) -> list[bytes]:
    """The parts of a correct message, to send or to spoil."""
    header = RequestHeader(number, INCARNATION, deadline)
    return [bytes(part) for part in seal(encode(request, DEFAULT_LIMITS), header, version)]


def changed(part: bytes, change: Callable[[dict[str, Any]], None]) -> bytes:
    """A header or body after `change` was applied to its map."""
    fields: dict[str, Any] = msgspec.msgpack.decode(part)
    change(fields)
    return msgspec.msgpack.encode(fields)
