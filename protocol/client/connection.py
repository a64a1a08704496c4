"""A client's connection to one worker, over any number of sockets one after the other.

    Connecting ──socket connected──▶ Greeting ──Welcome──▶ Open
        ▲                               └──Failure, another version or role──▶ Refused
        └──── a moment later ──── Broken ◀──disconnected, or another incarnation (from any of them)

A `DealerSocket` ends with its transport connection; a `Connection` lasts as long as the client knows the worker, and
opens the next socket. It belongs to the client's I/O thread, and none of its methods waits.
"""

import itertools
import logging
from collections.abc import Callable, Iterator, Sequence
from enum import Enum, auto
from typing import Any, NamedTuple

from protocol.client.call import Call
from protocol.client.call_window import CallWindow
from protocol.client.dealer_socket import DealerSocket, SocketEvent
from protocol.client.handshake import Handshake
from protocol.client.held_calls import HeldCalls
from protocol.client.worker_health import WorkerHealth
from protocol.codec import Envelope, decode, decode_header, encode, open_envelope, seal
from protocol.errors import MalformedMessage, ProtocolError, Unavailable, VantageError
from protocol.failure import DRAINING, OVERLOADED
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Reply, Request
from protocol.messages import Failure, Hello, Ping, Pong, Role
from protocol.security import Curve
from protocol.timeouts import Timeouts
from protocol.transport.sockets import Context, Socket, received, send

_log = logging.getLogger(__name__)

_SHORTEST_LIFE = 0.05
"""Seconds between two sockets, where each breaks at once."""

_DENIAL_LASTS = 1.0
"""Seconds until the next try to connect to a worker that did not take our key; ZeroMQ itself never tries again."""

_LACK_LASTS = 1.0
"""Seconds until the next try to connect of a process that can open no more files."""

_STARTING_POLL = 0.1
"""Seconds between two pings to a worker that starts, so that calls are sent as soon as it is ready."""


class Phase(Enum):
    """The phase of a connection."""

    CONNECTING = auto()
    GREETING = auto()
    OPEN = auto()
    REFUSED = auto()
    BROKEN = auto()


class Answer(NamedTuple):
    """What came back for a call: a reply, or the error of what came in place of one."""

    call: Call
    reply: Reply | ProtocolError
    header: ReplyHeader


class Connection:
    """One worker, as the client knows it.

    Attributes:
        held: the calls that the worker holds.
        health: what the worker's pongs tell.
        used: when a call was last sent on the connection.
        is_monitored: whether the worker is pinged also while it holds no calls, so that `is_at_work` stays current.
        late: number of replies to calls that had ended or were sent again.
        malformed: number of messages that could not be decoded.
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
        curve: Curve | None = None,
    ) -> None:
        self.address = address
        self.phase = Phase.CONNECTING
        self.held = HeldCalls()
        self.used = 0.0
        self.is_monitored = False
        self.late = 0
        self.malformed = 0
        self._hello = hello
        self._timeouts = timeouts
        self._limits = limits
        self._context = context
        self._clock = clock
        self._curve = curve
        self._handshake = Handshake(address, serves, curve)
        self.health = WorkerHealth(self.name, timeouts, clock)
        self._window = CallWindow()
        self._socket = DealerSocket(context, address, timeouts, limits, curve)
        self._opened = clock()
        self._ids = itertools.count(1)
        self._own_requests: set[int] = set()
        self._lost: list[Call] = []
        self._lacks_descriptors = False
        self._due = 0.0

    @property
    def name(self) -> str:
        """What messages call the worker."""
        return self._handshake.name

    @property
    def sockets(self) -> tuple[Socket, ...]:
        """The sockets that may have input for `receive`."""
        return () if self._is_closed else self._socket.sockets

    @property
    def descriptors(self) -> tuple[int, ...]:
        """The file descriptors to wait on for `receive`."""
        return () if self._is_closed else self._socket.descriptors

    @property
    def refusal(self) -> VantageError | None:
        """Why no call can be made on the connection; None unless the handshake failed."""
        return self._handshake.refusal

    @property
    def is_at_work(self) -> bool:
        """Whether the worker is connected and handles requests, by its last pong."""
        return self.phase is Phase.OPEN and self.health.is_at_work

    @property
    def takes_calls(self) -> bool:
        """Whether the worker is ready for one more call."""
        return self.is_at_work and len(self.held) < self._window.size

    def send(self, call: Call) -> None:
        """Send a call to the worker, which holds it from then on."""
        number = next(self._ids)
        self.used = self._clock()
        header = RequestHeader(number, self._hello.incarnation, max(0.0, call.deadline - self.used))
        send(self._socket.socket, seal(call.payload, header))
        if not self._wants_pings:
            self._due = self.used + self._heartbeat
        self.held.add(number, call)
        call.tries += 1

    def receive(self) -> Iterator[Answer]:
        """The answers to calls that the worker holds; afterwards, whether the socket was connected or broke."""
        if self._is_closed:
            return
        # Replies first: those that a worker sent before it was lost still count.
        yield from self._replies()
        events = [] if self.phase is Phase.BROKEN else self._socket.events()
        if SocketEvent.DISCONNECTED in events and self.phase is not Phase.BROKEN:
            # Once more: its last replies may have come between the two lines above.
            yield from self._replies()
        self._take_events(events)

    def take_lost(self) -> list[Call]:
        """Remove the calls that the worker held when it was lost, in the order in which they were sent."""
        lost, self._lost = self._lost, []
        return lost

    def take_movable(self) -> list[Call]:
        """Remove the calls that another worker may answer; this worker's replies to them count as late."""
        return self.held.take_movable()

    def forget(self, call: Call) -> None:
        """The call has ended: a reply to it counts as late."""
        self.held.forget(call)

    def maintain(self) -> None:
        """Do what is due: open the next socket, or ping a worker that holds calls or starts."""
        if not self._has_duties or self._clock() < self._due:
            return
        if self._is_closed:
            self._open()
        else:
            self._ping()

    @property
    def due(self) -> float | None:
        """When `maintain` may have something to do next."""
        # A worker that holds no calls now may soon hold the next one. The dispatcher wakes at the time planned for the
        # last call, which is early enough for the next one, so that call need not wake it.
        return self._due if self._has_duties or self._clock() < self._due else None

    def retire(self) -> list[Call]:
        """Close the connection for good; returns the calls that the worker held."""
        self._break()
        return self.take_lost()

    def close(self) -> None:
        """Close the socket and drop the messages that it holds."""
        self._socket.close()

    @property
    def _is_closed(self) -> bool:
        """Whether the connection has no socket at the moment; `maintain` opens the next one."""
        return self.phase is Phase.BROKEN or (self.phase is Phase.REFUSED and self._handshake.is_denied)

    @property
    def _has_duties(self) -> bool:
        return self._is_closed or self._wants_pings

    @property
    def _wants_pings(self) -> bool:
        return self.phase is Phase.OPEN and (self.is_monitored or len(self.held) > 0 or self.health.needs_pings)

    @property
    def _heartbeat(self) -> float:
        return self._handshake.heartbeat(self._timeouts.heartbeat)

    @property
    def _ping_interval(self) -> float:
        return min(_STARTING_POLL, self._heartbeat) if self.health.is_starting else self._heartbeat

    def _open(self) -> None:
        self._opened = self._clock()
        try:
            self._socket = DealerSocket(self._context, self.address, self._timeouts, self._limits, self._curve)
        except Unavailable as error:
            # Meanwhile calls end by their deadlines.
            if not self._lacks_descriptors:
                _log.warning("can't connect to %s again yet: %s", self.name, error)
            self._lacks_descriptors = True
            self._due = self._opened + _LACK_LASTS
            return
        self._lacks_descriptors = False
        self.phase = Phase.CONNECTING

    def _take_events(self, events: Sequence[SocketEvent]) -> None:
        for event in events if self.phase is not Phase.BROKEN else ():
            if event is SocketEvent.DISCONNECTED and self.phase is not Phase.CONNECTING:
                self._break()
                return
            if event is SocketEvent.DENIED:
                self._deny()
                return
            if event is SocketEvent.CONNECTED:
                self._greet()

    def _greet(self) -> None:
        self._handshake.begin()
        self.phase = Phase.GREETING
        self._ask(self._hello)
        # The pong says whether the worker is ready; until then it gets no calls.
        self._ask(Ping())

    def _deny(self) -> None:
        """Calls fail at once from now on, until one of the next tries to connect succeeds."""
        self._handshake.deny()
        self._socket.close()
        self.phase = Phase.REFUSED
        self._due = self._clock() + _DENIAL_LASTS

    def _end_handshake(self, reply: Reply | ProtocolError, incarnation: str) -> None:
        self._handshake.end(reply, incarnation)
        self.phase = Phase.OPEN if self.refusal is None else Phase.REFUSED
        self.health.expect_pings_every(self._heartbeat)
        self._due = self._clock() + self._ping_interval

    def _break(self) -> None:
        """Close the socket; the calls that the worker held are lost."""
        self._socket.close()
        self._lost.extend(self.held.take_all())
        self._own_requests.clear()
        self._handshake.forget()
        self.health = WorkerHealth(self.name, self._timeouts, self._clock)
        self._window = CallWindow()
        self.phase = Phase.BROKEN
        self._due = max(self._clock(), self._opened + _SHORTEST_LIFE)

    def _ping(self) -> None:
        self.health.pinged()
        self._ask(Ping())
        self._due = self._clock() + self._ping_interval

    def _ask(self, request: Request[Any]) -> None:
        """Send a request of the connection's own."""
        number = next(self._ids)
        header = RequestHeader(number, self._hello.incarnation, self._timeouts.call)
        send(self._socket.socket, seal(encode(request, self._limits), header))
        self._own_requests.add(number)

    def _replies(self) -> Iterator[Answer]:
        for parts in received(self._socket.socket, self._limits):
            try:
                envelope = open_envelope(parts, self._limits)
                header = decode_header(envelope.header, ReplyHeader)
            except ProtocolError:
                self.malformed += 1
                continue
            self.health.hear()
            if (answer := self._take_reply(envelope, header)) is not None:
                yield answer
            if self.phase is Phase.OPEN and header.incarnation != self._handshake.incarnation:
                # The worker was replaced and the socket stayed connected, as behind a proxy.
                self._break()
                return

    def _take_reply(self, envelope: Envelope, header: ReplyHeader) -> Answer | None:
        """The answer to a call; None for a reply to a request of the connection's own, and for a late one."""
        call = self.held.answered(header.request)
        if call is None and header.request not in self._own_requests:
            self.late += 1
            return None
        reply = self._decode(envelope)
        if call is not None:
            self._take_answer(call, reply)
            return Answer(call, reply, header)
        self._own_requests.discard(header.request)
        if isinstance(reply, Pong):
            self.health.answered_ping(reply, holds_calls=self.held.need_a_handler)
        elif self.phase is Phase.GREETING:
            self._end_handshake(reply, header.incarnation)
        return None

    def _take_answer(self, call: Call, reply: Reply | ProtocolError) -> None:
        """Learn from the answer to a call how the worker is."""
        refused = reply.code if isinstance(reply, Failure) else ""
        if refused == OVERLOADED:
            self._window.shrink(len(self.held))
        else:
            self._window.grow()
        if refused == DRAINING:
            self.health.refused_as_draining()
        elif isinstance(reply, Pong):
            self.health.answered_caller(reply)
        elif isinstance(reply, call.reply) and not call.at_once:
            self.health.answered_call()

    def _decode(self, envelope: Envelope) -> Reply | ProtocolError:
        try:
            message = decode(envelope, self._limits)
        except ProtocolError as error:
            return error
        if isinstance(message, Reply):
            return message
        return MalformedMessage(f"{self.name} sent a {type(message).__name__}, which is not a reply")
