"""A client's line to one worker: handshake, heartbeats, and which calls the worker holds.

    Connecting ──connected──▶ Greeting ──Welcome──▶ Open
        ▲                        └──Failure, another version or role──▶ Refused
        └───────────────disconnected (from any of them)────────────────┘

Belongs to the client's I/O thread; nothing here waits.
"""

import itertools
from collections.abc import Callable, Iterator
from enum import Enum, auto
from typing import Any, NamedTuple

import zmq
from zmq.utils.monitor import recv_monitor_message

from protocol.call import Call
from protocol.codec import Envelope, decode, decode_header, encode, open_envelope, seal
from protocol.errors import MalformedMessage, ProtocolError, VantageError, VersionMismatch, WrongRole
from protocol.failure import error_of
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Reply, Request
from protocol.messages import (
    OLDEST_PROTOCOL_VERSION,
    PROTOCOL_VERSION,
    Failure,
    Hello,
    Ping,
    Pong,
    Role,
    State,
    Welcome,
)
from protocol.sockets import Context, connect_dealer, received, send
from protocol.timeouts import Timeouts

_WATCHED = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED
_AGAIN = 0.001


class Phase(Enum):
    """Where a connection stands."""

    CONNECTING = auto()
    GREETING = auto()
    OPEN = auto()
    REFUSED = auto()


class Answer(NamedTuple):
    """What came back for a call: a reply, or why what came is none."""

    call: Call
    reply: Reply | ProtocolError
    header: ReplyHeader


class Connection:
    """One worker, as the client knows it.

    Attributes:
        outstanding: the calls that the worker holds, by the id of their last try.
        phase: where the connection stands.
        health: the worker's last pong since the handshake.
        heard: when anything last came from it.
        used: when a call was last sent on it.
        late: replies that nobody waits for any more.
        malformed: what came and was no message.
    """

    def __init__(
        self,
        address: str,
        *,
        hello: Hello,
        serves: Role | None,
        timeouts: Timeouts,
        limits: Limits,
        context: Context,
        clock: Callable[[], float],
    ) -> None:
        self.address = address
        self.name = f"{serves or 'worker'} at {address}"
        self.socket, self.monitor = connect_dealer(context, address, timeouts, limits, _WATCHED)
        self.outstanding: dict[int, Call] = {}
        self.phase = Phase.CONNECTING
        self.health: Pong | None = None
        self.heard: float | None = None
        self.used = 0.0
        self.late = 0
        self.malformed = 0
        self._hello = hello
        self._serves = serves
        self._timeouts = timeouts
        self._limits = limits
        self._clock = clock
        self._ids = itertools.count(1)
        self._asked: set[int] = set()
        self._lost: list[Call] = []
        self._greeting: Reply | ProtocolError | None = None
        self._due = 0.0

    def send(self, call: Call) -> bool:
        """Send a call to the worker, which holds it from then on; False where it could not be sent."""
        number = next(self._ids)
        header = RequestHeader(number, self._hello.incarnation, max(0.0, call.deadline - self._clock()))
        if not send(self.socket, seal(call.payload, header)):
            return False
        self.used = self._clock()
        if not self.outstanding:
            self._due = self.used + self._heartbeat
        self.outstanding[number] = call
        call.tries += 1
        return True

    def receive(self) -> Iterator[Answer]:
        """What came from the worker for the calls that it holds."""
        for parts in received(self.socket, self._limits):
            try:
                envelope = open_envelope(parts, self._limits)
                header = decode_header(envelope.header, ReplyHeader)
            except ProtocolError:
                self.malformed += 1
                continue
            self.heard = self._clock()
            if (answer := self._sort(envelope, header)) is not None:
                yield answer
            self._compare(header.incarnation)

    def watch(self) -> None:
        """Take note of connections made and broken."""
        while self.monitor.poll(0):
            event = recv_monitor_message(self.monitor)["event"]
            self._lose_all()
            if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self._greet()

    @property
    def refusal(self) -> VantageError | None:
        """Why no call can be made on it, once the handshake has come to nothing."""
        return None if self._greeting is None else self._objection(self._greeting)

    def take_lost(self) -> list[Call]:
        """The calls that the worker held when it was lost, in the order in which they were sent."""
        lost, self._lost = self._lost, []
        return lost

    def forget(self, call: Call) -> None:
        """Nobody waits for the call any more."""
        for number, held in self.outstanding.items():
            if held is call:
                del self.outstanding[number]
                return

    def tend(self) -> None:
        """Send what is due: a ping while the worker holds calls or starts, a Hello that did not go out."""
        if self._clock() < self._due or not self._is_watched:
            return
        if self.phase is Phase.GREETING:
            self._greet()
        else:
            self._ask(Ping())
            self._due = self._clock() + self._heartbeat

    @property
    def due(self) -> float | None:
        """When `tend` has something to do next."""
        return self._due if self._is_watched else None

    @property
    def state(self) -> State:
        """The worker's, as far as is known."""
        return State.READY if self.health is None else self.health.state

    def close(self) -> None:
        """Drop the connection and all that is under way on it."""
        self.socket.disable_monitor()
        self.monitor.close()
        self.socket.close()

    @property
    def _is_watched(self) -> bool:
        if self.phase is Phase.GREETING:
            return not self._asked
        return self.phase is Phase.OPEN and (
            bool(self.outstanding) or self.health is None or self.health.state is State.STARTING
        )

    @property
    def _heartbeat(self) -> float:
        """The slower of both sides' wishes; a NaN on the wire loses the comparison."""
        wished = self._greeting.heartbeat if isinstance(self._greeting, Welcome) else 0.0
        return max(self._timeouts.heartbeat, wished)

    def _greet(self) -> None:
        self.phase = Phase.GREETING
        # Until the socket has looked at its events it does not know its new connection.
        self.socket.get(zmq.EVENTS)
        self._ask(self._hello)
        self._due = self._clock() + _AGAIN

    def _ask(self, request: Request[Any]) -> None:
        number = next(self._ids)
        header = RequestHeader(number, self._hello.incarnation, self._timeouts.call)
        if send(self.socket, seal(encode(request, self._limits), header)):
            self._asked.add(number)

    def _sort(self, envelope: Envelope, header: ReplyHeader) -> Answer | None:
        call = self.outstanding.pop(header.request, None)
        if call is None and header.request not in self._asked:
            self.late += 1
            return None
        reply = self._decode(envelope)
        if call is not None:
            return Answer(call, reply, header)
        self._asked.discard(header.request)
        self._take_own(reply)
        return None

    def _decode(self, envelope: Envelope) -> Reply | ProtocolError:
        try:
            message = decode(envelope, self._limits)
        except ProtocolError as error:
            return error
        if isinstance(message, Reply):
            return message
        return MalformedMessage(f"{self.name} sent a {type(message).__name__}, which is no reply")

    def _take_own(self, reply: Reply | ProtocolError) -> None:
        if isinstance(reply, Pong):
            self.health = reply
        elif self.phase is Phase.GREETING:
            self._settle(reply)

    def _settle(self, reply: Reply | ProtocolError) -> None:
        """End the handshake."""
        self._greeting = reply
        self.phase = Phase.OPEN if self.refusal is None else Phase.REFUSED
        self._due = self._clock()

    def _objection(self, reply: Reply | ProtocolError) -> VantageError | None:
        if isinstance(reply, ProtocolError):
            return reply
        if isinstance(reply, Failure):
            return error_of(reply, self.name, "Hello")
        if not isinstance(reply, Welcome):
            return MalformedMessage(f"{self.name} answered Hello with {type(reply).__name__}")
        if not OLDEST_PROTOCOL_VERSION <= reply.version <= PROTOCOL_VERSION:
            return VersionMismatch(
                f"{self.name} wants version {reply.version} of the protocol; "
                f"this process speaks {OLDEST_PROTOCOL_VERSION} to {PROTOCOL_VERSION}"
            )
        if self._serves is not None and reply.role is not self._serves:
            return WrongRole(
                f"the worker at {self.address} serves {reply.role}, not {self._serves}; check the addresses"
            )
        return None

    def _compare(self, incarnation: str) -> None:
        """Notice a worker that was replaced without this connection being broken, as behind a proxy."""
        if isinstance(self._greeting, Welcome) and incarnation != self._greeting.incarnation:
            self._lose_all()
            self._greet()

    def _lose_all(self) -> None:
        self._lost.extend(self.outstanding.values())
        self.outstanding.clear()
        self._asked.clear()
        self._greeting = None
        self.health = None
        self.phase = Phase.CONNECTING
