"""A client's I/O thread: it polls the sockets, sends each call to a worker, and makes sure that each call ends.

A call waits here until a worker can take it, and is sent to the worker that holds the fewest calls. If that worker is
lost or refuses the call for the moment, it is sent again, until it is answered or its deadline has passed.
"""

import contextlib
import heapq
import itertools
import logging
import math
import threading
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

from msgspec import Struct

from protocol.client.call import Call
from protocol.client.connection import Answer, Connection, Phase
from protocol.client.diagnosis import Standing, expiry, standing
from protocol.errors import CallFailed, ClientClosed, MalformedMessage, ProtocolError, VantageError, WorkerLost
from protocol.failure import error_of
from protocol.messages import Failure
from protocol.system.priority import go_first
from protocol.timeouts import Timeouts
from protocol.transport.mailbox import Mailbox
from protocol.transport.sockets import has_input, poll_timeout, wait_for_input

_log = logging.getLogger(__name__)


class Statistics(Struct, frozen=True, kw_only=True):
    """A client's counts since it was opened.

    Attributes:
        late_replies: replies to calls that had ended or were sent again; they were dropped.
        retries: calls that were sent again, for any reason.
        losses: calls that were lost with their worker, or taken from one that hangs.
        malformed: messages that could not be decoded.
    """

    late_replies: int = 0
    retries: int = 0
    losses: int = 0
    malformed: int = 0


class Dispatcher:
    """Runs until `close`; every submitted call ends with a reply or a typed error."""

    def __init__(
        self, connections: Sequence[Connection], *, name: str, timeouts: Timeouts, clock: Callable[[], float]
    ) -> None:
        self._connections = list(connections)
        self._timeouts = timeouts
        self._clock = clock
        self._mailbox: Mailbox[Call | Callable[[], None]] = Mailbox()
        self._calls: dict[int, Call] = {}
        self._waiting: deque[Call] = deque()
        self._timers: list[tuple[float, int, Callable[[Call], None], int]] = []
        self._numbers = itertools.count()
        # Held by the I/O thread while it works, and by a caller's thread while it sends.
        self._sockets_in_use = threading.Lock()
        self._asleep_until = -math.inf
        self._closing = False
        self._monitoring = False
        self.turns = 0
        self._over: CallFailed | None = None
        self._retries = 0
        self._losses = 0
        self._late = 0
        self._malformed = 0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, call: Call) -> None:
        """Take a call, which ends by its deadline, or with `ClientClosed`. May be called from any thread."""
        self._mailbox.put_or_handle(call, self._sockets_in_use, self._send_from_here)
        # The I/O thread may have ended meanwhile, after it took the last items of the mailbox.
        if self._over is not None:
            self._fail_unread()

    def add(self, connect: Callable[[], Connection]) -> None:
        """Add a worker, on the connection that `connect` opens. May be called from any thread."""
        self._mailbox.put(lambda: self._add(connect))

    def remove(self, address: str) -> None:
        """Remove a worker, and send the calls that it holds to others. May be called from any thread."""
        self._mailbox.put(lambda: self._drop(address))

    def close(self) -> None:
        """End every call under way with `ClientClosed`, and end the I/O thread."""
        self._mailbox.put(self._stop)
        self._thread.join()
        self._mailbox.close()

    def disown(self) -> None:
        """Close it in a forked process; the thread and the sockets belong to the parent process, where they stay."""
        self._over = ClientClosed("the client is closed")
        self._mailbox.close()

    @property
    def is_monitoring(self) -> bool:
        """Whether workers are pinged also while they hold no calls."""
        return self._monitoring

    @property
    def statistics(self) -> Statistics:
        """The counts so far."""
        return Statistics(
            late_replies=self._late + sum(connection.late for connection in tuple(self._connections)),
            retries=self._retries,
            losses=self._losses,
            malformed=self._malformed + sum(connection.malformed for connection in tuple(self._connections)),
        )

    def wake(self) -> None:
        """Make the I/O thread take a turn, which `turns` counts."""
        self._mailbox.wake()

    def monitor(self) -> None:
        """Ping the workers also while they hold no calls, from now on. May be called from any thread."""
        self._mailbox.put(self._monitor)

    def standings(self) -> tuple[Standing, ...]:
        """How each worker stands, by its last messages. May be called from any thread."""
        return tuple(standing(connection) for connection in tuple(self._connections))

    def _send_from_here(self) -> None:
        """Send the submitted calls in the caller's thread, and wake the I/O thread if it has to wait otherwise now."""
        if self._over is not None:
            return
        try:
            other_sockets = self._admit()
        except Exception as error:
            # It ends the I/O thread, and with it every call, as if that had sent.
            self._mailbox.put(partial(_raise, error))
            return
        if other_sockets or self._due() < self._asleep_until or self._has_input():
            self._mailbox.wake()

    def _run(self) -> None:
        over = ClientClosed("the client is closed")
        go_first()
        try:
            while not self._closing:
                self._turn()
                self.turns += 1
        except Exception as error:
            # Without this thread no call would ever end.
            _log.exception("the client's I/O thread failed")
            over = ClientClosed(f"the client's I/O thread failed: {error!r}")
        finally:
            with self._sockets_in_use:
                self._end(over)

    def _turn(self) -> None:
        with self._sockets_in_use:
            descriptors = [self._mailbox.fileno()]
            for connection in self._connections:
                descriptors.extend(connection.descriptors)
            self._asleep_until = -math.inf if self._has_input() else self._due()
            patience = poll_timeout(self._asleep_until - self._clock())
        woken = wait_for_input(descriptors, patience)
        with self._sockets_in_use:
            if self._mailbox.fileno() in woken:
                self._mailbox.clear_wakeups()
                self._admit()
            for connection in self._connections:
                self._attend(connection)
            self._move_calls_from_suspects()
            self._run_timers()
            self._send_waiting()

    def _attend(self, connection: Connection) -> None:
        for answer in connection.receive():
            self._settle(connection, answer)
        for call in connection.take_lost():
            self._lose(call)
        connection.maintain()

    def _has_input(self) -> bool:
        return any(has_input(socket) for connection in self._connections for socket in connection.sockets)

    def _due(self) -> float:
        """When there is something to do next, without any input."""
        due = [connection.due for connection in self._connections]
        due.append(self._timers[0][0] if self._timers else None)
        return min((when for when in due if when is not None), default=math.inf)

    def _admit(self) -> bool:
        """Take the items of the mailbox; returns whether connections may have been added or removed."""
        other_sockets = False
        for item in self._mailbox.take():
            if not isinstance(item, Call):
                item()
                other_sockets = True
                continue
            item.number = next(self._numbers)
            self._calls[item.number] = item
            self._at(item.deadline, self._expire, item)
            # A worker would refuse it, perhaps before it has expired here.
            late = item.deadline <= self._clock()
            self._expire(item) if late else self._dispatch(item)
        return other_sockets

    def _stop(self) -> None:
        self._closing = True

    def _monitor(self) -> None:
        self._monitoring = True
        for connection in self._connections:
            connection.is_monitored = True

    def _add(self, connect: Callable[[], Connection]) -> None:
        try:
            connection = connect()
        except VantageError as error:
            _log.warning("can't connect to a worker: %s", error)
            return
        connection.is_monitored = self._monitoring
        self._connections.append(connection)

    def _drop(self, address: str) -> None:
        for connection in [one for one in self._connections if one.address == address]:
            self._connections.remove(connection)
            left = connection.retire()
            self._late += connection.late
            self._malformed += connection.malformed
            for call in left:
                self._dispatch(call)
        for call in [one for one in self._calls.values() if one.target == address]:
            self._give_up(call)

    def _dispatch(self, call: Call) -> None:
        if call.pending.cancelled():
            self._remove(call)
        if call.number not in self._calls:
            return
        eligible = self._eligible(call)
        usable = [one for one in eligible if one.takes_calls or (call.at_once and one.phase is Phase.OPEN)]
        if usable:
            min(usable, key=lambda one: _reluctance(one, call)).send(call)
            self._retries += call.tries > 1
            return
        refusals = [connection.refusal for connection in eligible]
        if refusals and refusals[0] is not None and None not in refusals:
            self._remove(call)
            call.fail(refusals[0], self._clock())
        elif call.target is not None and not eligible:
            self._give_up(call)
        elif call.at_once:
            self._waiting.appendleft(call)
        else:
            self._waiting.append(call)

    def _send_waiting(self) -> None:
        waiting, self._waiting = self._waiting, deque()
        # Calls that are answered at once come first: a worker that takes no other calls takes those.
        while waiting and (
            waiting[0].at_once or any(one.takes_calls or one.phase is Phase.REFUSED for one in self._connections)
        ):
            self._dispatch(waiting.popleft())
        self._waiting.extend(waiting)

    def _settle(self, connection: Connection, answer: Answer) -> None:
        call, reply, header = answer
        if isinstance(reply, Failure) and reply.retryable:
            call.refused_by = connection.address
            call.last_error = f"{reply.code}: {reply.message}"
            self._at(self._clock() + self._timeouts.backoff(call.tries), self._dispatch, call)
            return
        self._remove(call)
        if isinstance(reply, call.reply):
            call.succeed(reply, self._clock(), header.queue, header.compute)
        elif isinstance(reply, Failure):
            call.fail(error_of(reply, connection.name, call.request), self._clock())
        elif isinstance(reply, ProtocolError):
            call.fail(reply, self._clock())
        else:
            mistake = f"{connection.name} answered {call.request} with {type(reply).__name__}"
            call.fail(MalformedMessage(mistake), self._clock())

    def _lose(self, call: Call) -> None:
        """Send a lost call again: at once the first time, and after a growing pause when it is lost again."""
        call.losses += 1
        self._losses += 1
        if call.losses == 1:
            self._dispatch(call)
        else:
            self._at(self._clock() + self._timeouts.backoff(call.losses - 1), self._dispatch, call)

    def _move_calls_from_suspects(self) -> None:
        """Send the calls of a worker that hangs to others, if another takes calls; otherwise it may still answer."""
        for suspect in self._connections:
            if suspect.health.suspicion is not None and any(one.takes_calls for one in self._connections):
                for call in suspect.take_movable():
                    call.last_error = f"{suspect.name} hangs: {suspect.health.suspicion}"
                    self._lose(call)

    def _give_up(self, call: Call) -> None:
        """End a call to a worker that was removed."""
        self._remove(call)
        call.fail(WorkerLost(f"{call.target} was removed before it answered {call.request}"), self._clock())

    def _expire(self, call: Call) -> None:
        self._remove(call)
        call.fail(expiry(call, self._eligible(call), self._clock()), self._clock())
        with contextlib.suppress(ValueError):
            self._waiting.remove(call)
        for connection in self._connections:
            connection.forget(call)

    def _eligible(self, call: Call) -> list[Connection]:
        return [connection for connection in self._connections if call.target in (None, connection.address)]

    def _remove(self, call: Call) -> None:
        self._calls.pop(call.number, None)

    def _at(self, when: float, action: Callable[[Call], None], call: Call) -> None:
        # By number and not by the call: a timer outlives most calls, and a call holds its arrays.
        heapq.heappush(self._timers, (when, next(self._numbers), action, call.number))

    def _run_timers(self) -> None:
        while self._timers and self._timers[0][0] <= self._clock():
            _, _, action, number = heapq.heappop(self._timers)
            if (call := self._calls.get(number)) is not None:
                action(call)

    def _end(self, over: CallFailed) -> None:
        self._over = over
        for call in self._calls.values():
            call.fail(ClientClosed(f"{over} before {call.request} was answered"), self._clock())
        self._calls.clear()
        self._fail_unread()
        for connection in self._connections:
            connection.close()

    def _fail_unread(self) -> None:
        for call in self._mailbox.take():
            if isinstance(call, Call):
                call.fail(ClientClosed(f"{self._over} before {call.request} was answered"), self._clock())


def _raise(error: Exception) -> None:
    raise error


def _reluctance(connection: Connection, call: Call) -> tuple[bool, bool, int, float]:
    """A sort key, smallest for the connection that the call should be sent on."""
    return (
        call.refused_by == connection.address,
        bool(connection.health.lacks),
        len(connection.held),
        connection.used,
    )
