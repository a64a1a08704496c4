"""One call on its way: what is sent, who waits for it, and how often it was tried."""

from dataclasses import dataclass
from typing import Any

from protocol.client.pending import Pending, Timing
from protocol.codec import Payload
from protocol.message import Reply


@dataclass(eq=False, slots=True)
class Call:
    """Changed by the I/O thread only, once it is submitted. Times are seconds of the client's clock.

    Attributes:
        request: name of the request, for messages.
        reply: the type that answers it.
        timeout: seconds from `submitted` until it ends, one way or the other.
        target: address of the worker that it is for, or none for any.
        at_once: whether a worker answers it in whatever state it is, rather than when it is ready.
        number: its own, in the order of submission.
        tries: how often it was sent.
        losses: how often it was lost with its worker.
        refused_by: address of the worker that refused it last.
        last_error: what went wrong last, in words.
    """

    request: str
    payload: Payload
    reply: type[Reply]
    submitted: float
    timeout: float
    pending: Pending[Any]
    target: str | None = None
    at_once: bool = False
    number: int = 0
    tries: int = 0
    losses: int = 0
    refused_by: str | None = None
    last_error: str = ""

    @property
    def deadline(self) -> float:
        """When the caller stops waiting."""
        return self.submitted + self.timeout

    def succeed(self, reply: Reply, now: float, queue: float, compute: float) -> None:
        """Give the caller its reply."""
        self.pending.succeed(reply, Timing(wall=now - self.submitted, queue=queue, compute=compute))

    def fail(self, error: Exception, now: float) -> None:
        """Raise at the caller's."""
        self.pending.fail(error, Timing(wall=now - self.submitted))
