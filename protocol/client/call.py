"""One call: what is sent, the future that its caller waits for, and its tries so far."""

from dataclasses import dataclass
from typing import Any

from protocol.client.pending import Pending, Timing
from protocol.codec import Payload
from protocol.message import Reply


@dataclass(eq=False, slots=True)
class Call:
    """A call from its submission to its end. Once submitted, only the I/O thread changes it.

    Attributes:
        request: name of the request, for messages.
        payload: the encoded request.
        reply: the type of the reply.
        submitted: when the caller submitted it, in seconds of the client's clock.
        timeout: seconds from `submitted` until it ends, with a reply or an error.
        pending: the future that the caller holds.
        target: address of the only worker that may answer it; None for any worker.
        at_once: whether a worker answers it in any state, and not only when it is ready.
        number: counts calls in the order of submission.
        tries: number of times that it was sent.
        losses: number of times that it was lost with its worker.
        refused_by: address of the worker that refused it last.
        last_error: what went wrong last, for messages.
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
        """When the call ends at the latest, in seconds of the client's clock."""
        return self.submitted + self.timeout

    def succeed(self, reply: Reply, now: float, queue: float, compute: float) -> None:
        """End the call with its reply."""
        self.pending.succeed(reply, Timing(wall=now - self.submitted, queue=queue, compute=compute))

    def fail(self, error: Exception, now: float) -> None:
        """End the call with an error, which the caller's `result` raises."""
        self.pending.fail(error, Timing(wall=now - self.submitted))
