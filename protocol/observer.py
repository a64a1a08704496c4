"""Who watches a worker from within its process, such as what counts its requests: all that the worker knows of it."""

from enum import StrEnum
from typing import Any, Protocol

from msgspec import Struct

from protocol.message import Reply, Request
from protocol.messages import Failure, Pong


class Outcome(StrEnum):
    """What came of a request."""

    ANSWERED = "answered"
    FAILED = "failed"
    REFUSED = "refused"


class Finished(Struct, frozen=True, kw_only=True):
    """A request that is over.

    Attributes:
        request: its type's name.
        outcome: `failed` where its handler took it and came to nothing, `refused` where no handler saw it.
        code: the failure's, see `protocol.failure`; empty for an answer.
        queue: seconds that it waited for a handler; None where it was turned away at the monitor.
        compute: seconds that its handler took; None where none saw it.
    """

    request: str
    outcome: Outcome
    code: str = ""
    queue: float | None = None
    compute: float | None = None


class Turning(Protocol):
    """A thread that waits on sockets, one turn after the other."""

    @property
    def turns(self) -> int:
        """How many turns it has taken."""
        ...

    def wake(self) -> None:
        """Have it take a turn soon; one that hangs takes none. May be called from any thread."""
        ...


class Observed(Turning, Protocol):
    """A worker, for those who watch it."""

    def pong(self) -> Pong:
        """How it is, as it would answer a ping. May be called from any thread."""
        ...


class Observer(Protocol):
    """Watches one worker. It is called by the threads that do the work, so it neither waits nor raises."""

    def attend(self, worker: Observed) -> None:
        """This is the worker; it answers from now on."""
        ...

    def finished(self, request: Finished) -> None:
        """A request is over; pings, handshakes and drains are none."""
        ...


class _NoObserver:
    def attend(self, worker: Observed) -> None:
        pass

    def finished(self, request: Finished) -> None:
        pass


NO_OBSERVER: Observer = _NoObserver()
"""Watches nothing."""


def handled(request: Request[Any], reply: Reply, *, queue: float, compute: float) -> Finished:
    """What came of a request that a handler took; times are seconds."""
    name = type(request).__name__
    if isinstance(reply, Failure):
        return Finished(request=name, outcome=Outcome.FAILED, code=reply.code, queue=queue, compute=compute)
    return Finished(request=name, outcome=Outcome.ANSWERED, queue=queue, compute=compute)


def refused(request: Request[Any] | Reply, why: Failure, *, queue: float | None = None) -> Finished:
    """What came of a request that no handler saw, or of what came in its place."""
    return Finished(request=type(request).__name__, outcome=Outcome.REFUSED, code=why.code, queue=queue)
