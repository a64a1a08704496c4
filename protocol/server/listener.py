"""A worker's I/O thread: it answers pings and handshakes, and queues requests for the handlers.

So pings, handshakes and refusals are answered also while a handler computes. A reply is sent by the thread that has
computed it, or through a mailbox while the socket is in use.
"""

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import psutil

from protocol.array_part import Part
from protocol.catalogue import Message
from protocol.codec import decode, decode_header, encode, open_envelope, seal
from protocol.errors import NotPermitted, ProtocolError, VersionMismatch
from protocol.failure import draining, failure_of, overloaded
from protocol.header import ReplyHeader, RequestHeader, RequestNumber
from protocol.incarnation import new_incarnation
from protocol.limits import Limits
from protocol.message import Reply, Request
from protocol.messages import (
    OLDEST_PROTOCOL_VERSION,
    PROTOCOL_VERSION,
    Drain,
    Drained,
    Failure,
    Hello,
    Ping,
    Pong,
    Role,
    State,
    Welcome,
)
from protocol.observer import NO_OBSERVER, Observer, refused
from protocol.security.guard import Guard
from protocol.server.jobs import Jobs
from protocol.server.socket_file import SocketFile
from protocol.system.priority import go_first
from protocol.timeouts import Timeouts
from protocol.transport.mailbox import Mailbox
from protocol.transport.sockets import (
    Arrival,
    Socket,
    arrivals,
    close_router,
    descriptor,
    has_input,
    send,
    wait_for_input,
)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """A request for a handler; times are seconds of the worker's clock."""

    sender: Part
    number: int
    request: Request[Any]
    arrived: float
    expires: float


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The parts of a reply, ready to send."""

    sender: Part
    parts: list[Part]


class Listener:
    """Owns the worker's socket until the worker is drained or stopped.

    Attributes:
        jobs: the queue of the handlers' threads; None in it ends a thread.
        turns: number of turns that the I/O thread has taken.
    """

    def __init__(
        self,
        socket: Socket,
        *,
        role: Role,
        capabilities: Mapping[str, str],
        handlers: int,
        timeouts: Timeouts,
        limits: Limits,
        guard: Guard | None = None,
        observer: Observer = NO_OBSERVER,
        lacks: Callable[[], tuple[Role, ...]] = tuple,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.role = role
        self.observer = observer
        self.turns = 0
        self.incarnation = new_incarnation()
        self.clock = clock
        self.jobs: Jobs[Job | None] = Jobs()
        self._socket = socket
        self._file = SocketFile(socket, clock)
        self._welcome = Welcome(
            version=PROTOCOL_VERSION,
            role=role,
            incarnation=self.incarnation,
            capabilities=dict(capabilities),
            heartbeat=timeouts.heartbeat,
        )
        self._handlers = handlers
        self._limits = limits
        self._lacks = lacks
        self._guard = guard
        if guard is not None:
            guard.attach(socket)
        self._mailbox: Mailbox[Answer | State | Exception | None] = Mailbox()
        # Held by the I/O thread while it works, and by a handler's thread while it sends.
        self._socket_in_use = threading.Lock()
        self._process = psutil.Process()
        self._state = State.STARTING
        self._in_hand = 0
        self._answered = 0
        self._malformed = 0
        self._drainers: list[tuple[Part, int]] = []
        self._over = False
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=f"{role}-listener", daemon=True)

    @property
    def state(self) -> State:
        """The worker's state. May be called from any thread."""
        return State.BUSY if self._state is State.READY and self._in_hand else self._state

    def start(self) -> None:
        """Start the I/O thread."""
        self._thread.start()

    def wake(self) -> None:
        """Make the I/O thread take a turn, which `turns` counts."""
        self._mailbox.wake()

    def ready(self) -> None:
        """The handlers can take jobs."""
        self._mailbox.put(State.READY)

    def drain(self) -> None:
        """Refuse new requests, and end once those in hand are answered. May be called from a signal handler."""
        self._mailbox.put(State.DRAINING)

    @property
    def wakeup_descriptor(self) -> int:
        """For `signal.set_wakeup_fd`: any signal written to it drains the worker."""
        return self._mailbox.wakeup_descriptor

    def stop(self) -> None:
        """End now, and refuse the requests that wait.

        Raises:
            Exception: the error that ended the I/O thread before, if one did.
        """
        self._mailbox.put(None)
        self._thread.join()
        self._mailbox.close()
        if self._failure is not None:
            raise self._failure

    def answer(self, job: Job, reply: Reply, *, queue: float, compute: float) -> None:
        """Encode and send a job's reply. Called by the handlers' threads.

        Raises:
            InvalidInput, LimitExceeded: the reply can't be sent.
        """
        header = ReplyHeader(job.number, self.incarnation, queue=queue, compute=compute)
        answer = Answer(job.sender, seal(encode(reply, self._limits), header))
        self._mailbox.put_or_handle(answer, self._socket_in_use, self._send_from_here)

    def _send_from_here(self) -> None:
        """Send the answers in a handler's thread, and wake the I/O thread if it has more to do."""
        if self._socket.closed:
            return
        try:
            self._empty_mailbox()
        except Exception as error:
            # It ends the I/O thread, as if that had sent.
            self._mailbox.put(error)
            return
        if self._over or self._state is State.DRAINING or has_input(self._socket):
            self._mailbox.wake()

    def _run(self) -> None:
        go_first()
        try:
            while not self._over:
                self._turn()
                self.turns += 1
        except Exception as error:
            _log.exception("the worker's I/O thread failed")
            self._failure = error
        finally:
            with self._socket_in_use:
                self._end()

    def _turn(self) -> None:
        with self._socket_in_use:
            sockets = (self._socket, *(self._guard.monitors if self._guard else ()))
            descriptors = [self._mailbox.fileno(), *map(descriptor, sockets)]
            patience = 0 if any(map(has_input, sockets)) else self._file.timeout_ms
        woken = wait_for_input(descriptors, patience)
        with self._socket_in_use:
            if self._mailbox.fileno() in woken:
                self._mailbox.clear_wakeups()
                self._empty_mailbox()
            if self._guard is not None:
                self._guard.read_events()
            self._file.restore_if_missing()
            for arrival in arrivals(self._socket, self._limits, keyed=self._guard is not None):
                self._take(arrival)
            self._end_if_drained()

    def _empty_mailbox(self) -> None:
        for item in self._mailbox.take():
            if isinstance(item, Answer):
                self._in_hand -= 1
                self._answered += 1
                self._deliver(item.sender, item.parts)
            elif item is State.DRAINING or (item is State.READY and self._state is State.STARTING):
                self._state = item
            elif isinstance(item, Exception):
                raise item
            elif item is None:
                self._over = True
        if self._mailbox.was_signalled:
            self._state = State.DRAINING

    def _take(self, arrival: Arrival) -> None:
        """Answer or queue one message; no message ends this thread."""
        sender, *message = arrival.parts
        try:
            envelope = open_envelope(message, self._limits)
            header = decode_header(envelope.header, RequestHeader)
            request = decode(envelope, self._limits)
            refusal = self._guard.objection(arrival.key, arrival.address, request) if self._guard else None
            if refusal is not None:
                self._refuse(sender, header.request, request, failure_of(NotPermitted(refusal)))
            else:
                self._handle(sender, header, request)
        except ProtocolError as error:
            self._count_malformed(error)
            if (number := _request_number(message)) is not None:
                self._reply(sender, number, failure_of(error))

    def _handle(self, sender: Part, header: RequestHeader, message: Message) -> None:
        match message:
            case Ping():
                self._reply(sender, header.request, self.pong())
            case Hello():
                self._reply(sender, header.request, self._greet(message))
            case Drain():
                self._drainers.append((sender, header.request))
                self._state = State.DRAINING
            case Request():
                self._queue(sender, header, message)
            case _:
                reason = f"{type(message).__name__} is not a request"
                self._reply(sender, header.request, Failure(code="unsupported", message=reason))

    def _queue(self, sender: Part, header: RequestHeader, request: Request[Any]) -> None:
        if self._state is State.DRAINING:
            self._refuse(sender, header.request, request, draining())
        elif self._in_hand >= self._limits.queue:
            self._refuse(sender, header.request, request, overloaded(self._in_hand))
        else:
            now = self.clock()
            self._in_hand += 1
            self.jobs.put(Job(sender, header.request, request, now, now + header.deadline))

    def _refuse(self, sender: Part, number: int, message: Message, why: Failure) -> None:
        self._reply(sender, number, why)
        self.observer.finished(refused(message, why))

    def _greet(self, hello: Hello) -> Reply:
        if hello.newest_version < OLDEST_PROTOCOL_VERSION or hello.oldest_version > PROTOCOL_VERSION:
            mismatch = VersionMismatch(
                f"it speaks versions {OLDEST_PROTOCOL_VERSION} to {PROTOCOL_VERSION} of the protocol, "
                f"the other side {hello.oldest_version} to {hello.newest_version}; update the older one"
            )
            _log.warning("refused %s %s: %s", hello.role, hello.incarnation, mismatch)
            return failure_of(mismatch)
        return self._welcome

    def pong(self) -> Pong:
        """The worker's state and counters. May be called from any thread."""
        return Pong(
            incarnation=self.incarnation,
            state=self.state,
            progress=self._answered,
            queue_depth=self._in_hand,
            resident_bytes=self._process.memory_info().rss,
            malformed=self._malformed,
            lacks=self._lacks(),
        )

    def _reply(self, sender: Part, number: int, reply: Reply) -> None:
        header = ReplyHeader(number, self.incarnation)
        self._deliver(sender, seal(encode(reply, self._limits), header))

    def _deliver(self, sender: Part, parts: list[Part]) -> None:
        if not send(self._socket, [sender, *parts]):
            _log.debug("a reply was dropped: its client has gone or does not read")

    def _count_malformed(self, error: ProtocolError) -> None:
        self._malformed += 1
        # At the 1st, 2nd, 4th, 8th …: a peer that sends garbage must not fill the disk with log lines.
        if self._malformed & (self._malformed - 1) == 0:
            _log.warning("%d malformed messages so far; the last one: %s", self._malformed, error)

    def _end_if_drained(self) -> None:
        if self._state is State.DRAINING and self._in_hand == 0:
            for sender, number in self._drainers:
                self._reply(sender, number, Drained())
            self._over = True

    def _end(self) -> None:
        for job in self.jobs.take_all():
            if job is not None:
                self._refuse(job.sender, job.number, job.request, draining())
        for _ in range(self._handlers):
            self.jobs.put(None)
        if self._guard is not None:
            self._guard.detach()
        close_router(self._socket)


def _request_number(message: list[Part]) -> int | None:
    """The id of a malformed request, if its header has one, so that its sender can be answered."""
    with contextlib.suppress(ProtocolError, IndexError):
        return decode_header(message[1], RequestNumber).request
    return None
