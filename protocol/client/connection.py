"""A client's line to one worker: handshake, heartbeats, and which calls the worker holds.

    Connecting ──connected──▶ Greeting ──Welcome──▶ Open
        ▲                        └──Failure, another version or role──▶ Refused
        └──── a moment later ──── Broken ◀──disconnected, or another incarnation (from any of them)

Belongs to the client's I/O thread; nothing here waits.
"""

import itertools
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from enum import Enum, auto
from typing import Any, NamedTuple

from msgspec.structs import replace

from protocol.client.call import Call
from protocol.client.dealer_socket import DealerSocket, LineEvent
from protocol.client.failure_detector import FailureDetector, Suspicion
from protocol.codec import Envelope, decode, decode_header, encode, open_envelope, seal
from protocol.errors import MalformedMessage, NotPermitted, ProtocolError, Unavailable, VantageError
from protocol.failure import DRAINING, OVERLOADED
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.message import Reply, Request
from protocol.messages import (
    AT_WORK,
    Failure,
    Hello,
    Ping,
    Pong,
    Role,
    State,
    Welcome,
)
from protocol.security import Curve
from protocol.timeouts import Timeouts
from protocol.transport.handshake import denial, name_of, objection
from protocol.transport.sockets import Context, Socket, received, send

_log = logging.getLogger(__name__)

_SHORTEST_LIFE = 0.05
"""Seconds between two tries to open a connection that breaks at once, again and again."""

_DENIAL_LASTS = 1.0
"""Seconds after which a worker that did not take our key is asked again; ZeroMQ itself never asks twice."""

_LACK_LASTS = 1.0
"""Seconds after which a process that can open no more files tries to connect again."""

_LONGEST_HEARTBEAT = 10.0

_STARTING_POLL = 0.1
"""Seconds between two pings to a worker that starts, so that calls don't wait for it any longer than it takes."""


class Phase(Enum):
    """Where a connection stands."""

    CONNECTING = auto()
    GREETING = auto()
    OPEN = auto()
    REFUSED = auto()
    BROKEN = auto()


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
        window: how many calls the worker may hold; endless until it says that it is overloaded.
        suspicion: why the worker gets no calls although it is connected.
        watched: whether it is pinged also while it holds no calls, so that `is_at_work` is no older than that.
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
        curve: Curve | None = None,
    ) -> None:
        self.address = address
        self.name = name_of(address, serves)
        self.outstanding: dict[int, Call] = {}
        self.phase = Phase.CONNECTING
        self.health: Pong | None = None
        self.heard: float | None = None
        self.used = 0.0
        self.window = math.inf
        self.suspicion: Suspicion | None = None
        self.watched = False
        self.late = 0
        self.malformed = 0
        self._hello = hello
        self._serves = serves
        self._timeouts = timeouts
        self._limits = limits
        self._context = context
        self._clock = clock
        self._curve = curve
        self._denial: NotPermitted | None = None
        self._socket = DealerSocket(context, address, timeouts, limits, curve)
        self._opened = clock()
        self._ids = itertools.count(1)
        self._asked: set[int] = set()
        self._lost: list[Call] = []
        self._greeting: Reply | ProtocolError | None = None
        self._incarnation = ""
        self._failure_detector = FailureDetector(timeouts.heartbeat, timeouts)
        self._lacks_descriptors = False
        self._due = 0.0

    @property
    def sockets(self) -> tuple[Socket, ...]:
        """Where something may come for `receive`."""
        return () if self._is_closed else self._socket.sockets

    @property
    def descriptors(self) -> tuple[int, ...]:
        """What to wait on for `receive`."""
        return () if self._is_closed else self._socket.descriptors

    def send(self, call: Call) -> None:
        """Send a call to the worker, which holds it from then on."""
        number = next(self._ids)
        self.used = self._clock()
        header = RequestHeader(number, self._hello.incarnation, max(0.0, call.deadline - self.used))
        send(self._socket.socket, seal(call.payload, header))
        if not self._wants_pings:
            self._due = self.used + self._heartbeat
        self.outstanding[number] = call
        call.tries += 1

    def receive(self) -> Iterator[Answer]:
        """What came from the worker for the calls that it holds; then, whether the connection was made or broken."""
        if self._is_closed:
            return
        # Replies first: what a worker said before it was lost still counts.
        yield from self._replies()
        events = [] if self.phase is Phase.BROKEN else self._socket.events()
        if LineEvent.BROKEN in events and self.phase is not Phase.BROKEN:
            # And again: its last words may have come while we looked at the events.
            yield from self._replies()
        self._take_events(events)

    def _replies(self) -> Iterator[Answer]:
        for parts in received(self._socket.socket, self._limits):
            try:
                envelope = open_envelope(parts, self._limits)
                header = decode_header(envelope.header, ReplyHeader)
            except ProtocolError:
                self.malformed += 1
                continue
            self._hear()
            if (answer := self._sort(envelope, header)) is not None:
                yield answer
            if self.phase is Phase.OPEN and header.incarnation != self._incarnation:
                # Replaced without a broken connection, as behind a proxy.
                self._break()
                return

    @property
    def refusal(self) -> VantageError | None:
        """Why no call can be made on it, once the handshake has come to nothing."""
        return self._denial if self._greeting is None else objection(self._greeting, self.address, self._serves)

    @property
    def is_at_work(self) -> bool:
        """Whether the worker is there and handles requests, as far as was heard."""
        return (
            self.phase is Phase.OPEN
            and self.suspicion is None
            and self.health is not None
            and self.health.state in AT_WORK
        )

    @property
    def lacks(self) -> tuple[Role, ...]:
        """The roles of which the worker knows nobody at work, as far as was heard."""
        return () if self.health is None else self.health.lacks

    @property
    def takes_calls(self) -> bool:
        """Whether the worker is ready for one call more."""
        return self.is_at_work and len(self.outstanding) < self.window

    def take_lost(self) -> list[Call]:
        """The calls that the worker held when it was lost, in the order in which they were sent."""
        lost, self._lost = self._lost, []
        return lost

    def take_back(self) -> list[Call]:
        """The calls that the worker holds and that another may answer; what it still says to them comes too late."""
        taken = {number: call for number, call in self.outstanding.items() if not call.at_once}
        for number in taken:
            del self.outstanding[number]
        return list(taken.values())

    def forget(self, call: Call) -> None:
        """Nobody waits for the call any more."""
        for number, held in self.outstanding.items():
            if held is call:
                del self.outstanding[number]
                return

    def tend(self) -> None:
        """Do what is due: open a broken connection again, ping a worker that holds calls or starts."""
        if not self._has_duties or self._clock() < self._due:
            return
        if self._is_closed:
            self._open()
        else:
            self._ping()

    @property
    def due(self) -> float | None:
        """When `tend` may have something to do next."""
        # A worker that holds no calls any more may soon hold the next. Whoever has planned to look after the last one
        # is in time for that, and need not be told.
        return self._due if self._has_duties or self._clock() < self._due else None

    def retire(self) -> list[Call]:
        """Drop the connection for good; returns the calls that the worker held."""
        self._break()
        return self.take_lost()

    def close(self) -> None:
        """Drop the connection and all that is under way on it."""
        self._socket.close()

    @property
    def _is_closed(self) -> bool:
        """Whether there is no socket for now; `tend` opens the next one."""
        return self.phase is Phase.BROKEN or (self.phase is Phase.REFUSED and self._denial is not None)

    @property
    def _has_duties(self) -> bool:
        return self._is_closed or self._wants_pings

    @property
    def _wants_pings(self) -> bool:
        return self.phase is Phase.OPEN and (
            self.watched
            or bool(self.outstanding)
            or self.suspicion is not None
            or self.health is None
            or self._is_starting
        )

    @property
    def _is_starting(self) -> bool:
        return self.health is not None and self.health.state is State.STARTING

    @property
    def _ping_interval(self) -> float:
        return min(_STARTING_POLL, self._heartbeat) if self._is_starting else self._heartbeat

    @property
    def _heartbeat(self) -> float:
        """The slower of both sides' wishes, within reason: what a worker wishes may be anything, even NaN."""
        wished = self._greeting.heartbeat if isinstance(self._greeting, Welcome) else 0.0
        return max(self._timeouts.heartbeat, min(wished, _LONGEST_HEARTBEAT))

    def _hear(self) -> None:
        self.heard = self._clock()
        self._failure_detector.heard()
        self._judge()

    def _judge(self) -> None:
        before, self.suspicion = self.suspicion, self._failure_detector.suspicion
        if self.suspicion is not None and before is None:
            _log.warning("%s gets no more calls: %s", self.name, self.suspicion)
        if self.suspicion is None and before is not None:
            _log.info("%s gets calls again", self.name)

    def _take_events(self, events: Sequence[LineEvent]) -> None:
        for event in events if self.phase is not Phase.BROKEN else ():
            if event is LineEvent.BROKEN and self.phase is not Phase.CONNECTING:
                self._break()
                return
            if event is LineEvent.DENIED:
                self._take_denial()
                return
            if event is LineEvent.MADE:
                self._denial = None
                self.phase = Phase.GREETING
                self._ask(self._hello)
                # What it answers to this says whether it is ready; until then it gets no calls.
                self._ask(Ping())

    def _take_denial(self) -> None:
        """It does not take our key. Calls are told so at once, until one of the next tries succeeds."""
        self._denial = denial(self.name, self._curve)
        self._socket.close()
        self.phase = Phase.REFUSED
        self._due = self._clock() + _DENIAL_LASTS

    def _break(self) -> None:
        """Drop the connection; the calls that the worker held are lost."""
        self._socket.close()
        self._lost.extend(self.outstanding.values())
        self.outstanding.clear()
        self._asked.clear()
        self._greeting = None
        self.health = None
        self.suspicion = None
        self.window = math.inf
        self.phase = Phase.BROKEN
        self._due = max(self._clock(), self._opened + _SHORTEST_LIFE)

    def _open(self) -> None:
        self._opened = self._clock()
        try:
            self._socket = DealerSocket(self._context, self.address, self._timeouts, self._limits, self._curve)
        except Unavailable as error:
            # Calls end by their deadlines meanwhile.
            if not self._lacks_descriptors:
                _log.warning("can't connect to %s again yet: %s", self.name, error)
            self._lacks_descriptors = True
            self._due = self._opened + _LACK_LASTS
            return
        self._lacks_descriptors = False
        self.phase = Phase.CONNECTING

    def _ping(self) -> None:
        # A worker that loads libraries may be silent for long; the startup clock is for that.
        if not self._is_starting:
            self._failure_detector.asked()
            self._judge()
        self._ask(Ping())
        self._due = self._clock() + self._ping_interval

    def _ask(self, request: Request[Any]) -> None:
        number = next(self._ids)
        header = RequestHeader(number, self._hello.incarnation, self._timeouts.call)
        send(self._socket.socket, seal(encode(request, self._limits), header))
        self._asked.add(number)

    def _sort(self, envelope: Envelope, header: ReplyHeader) -> Answer | None:
        call = self.outstanding.pop(header.request, None)
        if call is None and header.request not in self._asked:
            self.late += 1
            return None
        reply = self._decode(envelope)
        if call is not None:
            self._note(call, reply)
            return Answer(call, reply, header)
        self._asked.discard(header.request)
        if isinstance(reply, Pong):
            self._examine(reply)
        elif self.phase is Phase.GREETING:
            self._settle(reply, header.incarnation)
        return None

    def _examine(self, pong: Pong) -> None:
        self.health = pong
        self._failure_detector.answered(pong, holds_calls=any(not call.at_once for call in self.outstanding.values()))
        self._judge()

    def _note(self, call: Call, reply: Reply | ProtocolError) -> None:
        """What the answer to a call tells of the worker."""
        self._fit_window(reply)
        if isinstance(reply, Pong):
            # Not for the failure detector, which counts heartbeats: a caller may ask as often as it likes.
            self.health = reply
        elif isinstance(reply, call.reply) and not call.at_once:
            self._failure_detector.moved()

    def _fit_window(self, reply: Reply | ProtocolError) -> None:
        """Send no more than the worker takes, and try one more each time all of it was answered."""
        if isinstance(reply, Failure) and reply.code == OVERLOADED:
            self.window = max(1.0, len(self.outstanding))
        else:
            self.window += 1 / self.window
        if isinstance(reply, Failure) and reply.code == DRAINING and self.health is not None:
            self.health = replace(self.health, state=State.DRAINING)

    def _decode(self, envelope: Envelope) -> Reply | ProtocolError:
        try:
            message = decode(envelope, self._limits)
        except ProtocolError as error:
            return error
        if isinstance(message, Reply):
            return message
        return MalformedMessage(f"{self.name} sent a {type(message).__name__}, which is no reply")

    def _settle(self, reply: Reply | ProtocolError, incarnation: str) -> None:
        """End the handshake."""
        self._greeting = reply
        self._incarnation = incarnation
        self.phase = Phase.OPEN if self.refusal is None else Phase.REFUSED
        self._failure_detector = FailureDetector(self._heartbeat, self._timeouts)
        self._due = self._clock() + self._ping_interval
