"""The interface between a worker and an observer in its process, such as the one that counts requests."""

from enum import StrEnum
from typing import Any, Protocol

from msgspec import Struct

from protocol.message import Reply, Request
from protocol.messages import Failure, Pong


class Outcome(StrEnum):
    """The outcome of a request."""

    ANSWERED = "answered"
    FAILED = "failed"
    REFUSED = "refused"


class Finished(Struct, frozen=True, kw_only=True):
    """A request that has ended.

    Attributes:
        request: the name of its type.
        outcome: `failed` if its handler failed, `refused` if no handler took it.
        code: the failure's code, see `protocol.failure`; empty for an answer.
        queue: seconds that it waited for a handler; None if the I/O thread refused it.
        compute: seconds that its handler took; None if no handler took it.
    """

    request: str
    outcome: Outcome
    code: str = ""
    queue: float | None = None
    compute: float | None = None


class Turning(Protocol):
    """A thread that polls sockets, once a turn."""

    @property
    def turns(self) -> int:
        """The number of turns so far."""
        ...

    def wake(self) -> None:
        """Make it take a turn soon; a thread that hangs takes none. May be called from any thread."""
        ...


class Observed(Turning, Protocol):
    """A worker, as its observer sees it."""

    def pong(self) -> Pong:
        """The worker's answer to a ping. May be called from any thread."""
        ...


class Observer(Protocol):
    """Observes one worker. The worker's own threads call it, so its methods must neither wait nor raise."""

    def attend(self, worker: Observed) -> None:
        """The worker starts to answer."""
        ...

    def finished(self, request: Finished) -> None:
        """A request has ended. Pings, handshakes and drains do not count."""
        ...


class _NoObserver:
    def attend(self, worker: Observed) -> None:
        pass

    def finished(self, request: Finished) -> None:
        pass


NO_OBSERVER: Observer = _NoObserver()
"""Does nothing."""


def handled(request: Request[Any], reply: Reply, *, queue: float, compute: float) -> Finished:
    """The outcome of a request that a handler took; times are seconds."""
    name = type(request).__name__
    if isinstance(reply, Failure):
        return Finished(request=name, outcome=Outcome.FAILED, code=reply.code, queue=queue, compute=compute)
    return Finished(request=name, outcome=Outcome.ANSWERED, queue=queue, compute=compute)


def refused(request: Request[Any] | Reply, why: Failure, *, queue: float | None = None) -> Finished:
    """The outcome of a request that no handler took, or of another message in its place."""
    return Finished(request=type(request).__name__, outcome=Outcome.REFUSED, code=why.code, queue=queue)
