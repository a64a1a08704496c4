"""What `Client` and `Pool` have in common: calls go in, futures come out.

Sockets and their I/O thread belong to one process. A process that was forked from it, or that received the client as a
pickle (`spawn`, `forkserver`), opens connections of its own with its first call.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from types import TracebackType
from typing import Any, Self

from protocol.catalogue import reply_type
from protocol.client.call import Call
from protocol.client.connection import Connection
from protocol.client.dispatcher import Dispatcher, Statistics
from protocol.client.pending import Pending
from protocol.codec import encode
from protocol.deadline import remaining
from protocol.errors import DeadlineExceeded, InvalidInput, NotPermitted
from protocol.incarnation import new_incarnation
from protocol.limits import Limits
from protocol.message import ReplyT, Request
from protocol.messages import Drain, Hello, Ping, Pong, Role, State, Welcome
from protocol.quantities import MOST_SECONDS
from protocol.security import LOCAL_ONLY, Security
from protocol.system.process_lock import ProcessLock
from protocol.timeouts import Timeouts
from protocol.transport.sockets import Context, new_context

_READY_POLL = 0.1
_ANSWERED_IN_ANY_STATE = (Hello, Ping, Drain)


class Caller:
    """Calls workers. May be used by any number of threads."""

    def __init__(
        self,
        addresses: Sequence[str],
        *,
        role: Role,
        serves: Role | None,
        timeouts: Timeouts,
        limits: Limits,
        context: Context | None,
        security: Security = LOCAL_ONLY,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if len(set(addresses)) < len(addresses):
            raise InvalidInput(f"a client needs different addresses, not {list(addresses)}")
        self._addresses = tuple(addresses)
        self._serves = serves
        self._timeouts = timeouts
        self._limits = limits
        self._role = role
        self._security = security
        self._clock = clock
        self._announced: dict[str, str] = {}
        self._closed = False
        self._opening = ProcessLock()
        self._opened = self._open(context)
        self._process = os.getpid()

    @property
    def statistics(self) -> Statistics:
        """The counts so far: late replies, retries, losses, malformed messages."""
        return self._dispatcher.statistics

    def call(self, request: Request[ReplyT], *, deadline: float | None = None) -> ReplyT:
        """Send a request, and wait for its reply. Requests are pure, so one that is lost is sent again.

        Args:
            request: its arrays are not copied; do not change them until the call has ended.
            deadline: seconds from now; `timeouts.call` by default. Inside a handler, the deadline of the request that
                the handler answers counts if it is sooner.

        Raises:
            DeadlineExceeded, WorkerLost, Rejected, ClientClosed: see `protocol.errors`.
            VersionMismatch: the worker shares no version of the protocol with this process.
            WrongRole: the worker serves another role.
            NotPermitted: the worker does not take our key.
            MalformedMessage: the worker did not answer with this request's reply.
            InvalidInput, LimitExceeded: the request can't be sent.
        """
        return self.submit(request, deadline=deadline).result()

    def submit(self, request: Request[ReplyT], *, deadline: float | None = None) -> Pending[ReplyT]:
        """Send a request and return at once; the future ends as `call` would."""
        return self._submit(request, deadline, None, at_once=isinstance(request, _ANSWERED_IN_ANY_STATE))

    def map(self, requests: Iterable[Request[ReplyT]], *, deadline: float | None = None) -> Iterator[ReplyT]:
        """The replies in the order of the requests, of which `limits.under_way` are under way to each worker."""
        under_way: deque[Pending[ReplyT]] = deque()
        try:
            for request in requests:
                under_way.append(self.submit(request, deadline=deadline))
                if len(under_way) >= self._limits.under_way * max(1, len(self._addresses)):
                    yield under_way.popleft().result()
            while under_way:
                yield under_way.popleft().result()
        finally:
            for pending in under_way:
                pending.cancel()

    def close(self) -> None:
        """End the calls under way with `ClientClosed`, and close sockets and the I/O thread.

        In a forked process, this closes the client in that process only.
        """
        self._closed = True
        if self._is_inherited:
            self._opened.disown()
            return
        self._opened.close()
        self._release_context()

    def __reduce__(self) -> tuple[Callable[[], Self], tuple[()]]:
        """Pickle the arguments only; the unpickled client opens connections of its own.

        Raises:
            NotPermitted: it has a secret key, which must not be pickled.
        """
        if self._security.credentials is not None:
            raise NotPermitted("a client with a secret key can't be sent to another process; make one there")
        return partial(type(self), **self._arguments()), ()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _arguments(self) -> dict[str, Any]:
        """The arguments that make an equal client."""
        return {
            "role": self._role,
            "serves": self._serves,
            "timeouts": self._timeouts,
            "limits": self._limits,
            "security": self._security,
        }

    @property
    def _is_inherited(self) -> bool:
        """Whether the connections belong to the process that this one was forked from."""
        return self._process != os.getpid()

    @property
    def _dispatcher(self) -> Dispatcher:
        """The dispatcher of this process."""
        if self._is_inherited and not self._closed:
            self._reopen()
        return self._opened

    def _reopen(self) -> None:
        with self._opening:
            if self._is_inherited:
                inherited = self._opened
                self._opened = self._open(None)
                if inherited.is_monitoring:
                    self._opened.monitor()
                inherited.disown()
                self._process = os.getpid()

    def _open(self, context: Context | None) -> Dispatcher:
        self._hello = Hello(role=self._role, incarnation=new_incarnation())
        self._owns_context = context is None
        self._context: Context = new_context() if context is None else context
        connections: list[Connection] = []
        try:
            announced = self._announced
            connections.extend(self._connect(address, announced.get(address, "")) for address in self._addresses)
        except BaseException:
            for connection in connections:
                connection.close()
            self._release_context()
            raise
        return Dispatcher(connections, name=f"{self._role}-client", timeouts=self._timeouts, clock=self._clock)

    def _connect(self, address: str, announced_key: str = "") -> Connection:
        return Connection(
            address,
            curve=self._security.curve_to(address, self._serves, announced_key),
            hello=self._hello,
            serves=self._serves,
            timeouts=self._timeouts,
            limits=self._limits,
            context=self._context,
            clock=self._clock,
        )

    def _release_context(self) -> None:
        if self._owns_context:
            self._context.term()

    def _submit(
        self, request: Request[ReplyT], deadline: float | None, target: str | None, *, at_once: bool
    ) -> Pending[ReplyT]:
        timeout = self._timeouts.call if deadline is None else deadline
        if not -MOST_SECONDS <= timeout <= MOST_SECONDS:
            raise InvalidInput(f"a deadline is a number of seconds, not {timeout}")
        pending: Pending[ReplyT] = Pending()
        call = Call(
            request=type(request).__name__,
            payload=encode(request, self._limits),
            reply=reply_type(type(request)),
            submitted=self._clock(),
            timeout=remaining(timeout),
            target=target,
            at_once=at_once,
            pending=pending,
        )
        self._dispatcher.submit(call)
        return pending

    def _ping(self, address: str, deadline: float | None = None) -> Pong:
        return self._submit(Ping(), deadline, address, at_once=True).result()

    def _wait_ready(self, address: str, ends: float) -> Welcome:
        try:
            while self._ping(address, ends - self._clock()).state is State.STARTING:
                time.sleep(min(_READY_POLL, self._timeouts.heartbeat))
        except DeadlineExceeded as error:
            raise DeadlineExceeded(f"not ready within {self._timeouts.startup:.3g} s: {error}") from error
        return self._submit(self._hello, None, address, at_once=True).result()

    def _startup_ends(self) -> float:
        return self._clock() + self._timeouts.startup
