"""A reply that is under way, and where its time went."""

import os
from concurrent.futures import Future, InvalidStateError

from msgspec import Struct

from protocol.errors import ClientClosed
from protocol.message import ReplyT


class Timing(Struct, frozen=True):
    """Seconds of one call: `wall` from submit to reply, of which `queue` and `compute` were spent in the worker."""

    wall: float
    queue: float = 0.0
    compute: float = 0.0

    @property
    def transport(self) -> float:
        """What is left for coding, sockets, threads, and tries that came to nothing."""
        return self.wall - self.queue - self.compute


class Pending(Future[ReplyT]):
    """A future of a reply. It always ends by its call's deadline, with the reply or a typed error.

    In a process that is forked meanwhile it ends at once, with `ClientClosed`: nobody there waits for the reply.
    """

    _timing: Timing | None = None

    def __init__(self) -> None:
        super().__init__()
        self._process = os.getpid()
        self._reply: ReplyT | None = None
        self._error: Exception | None = None

    @property
    def timing(self) -> Timing:
        """Where the time went.

        Raises:
            InvalidStateError: the call is not over.
        """
        if self._timing is None:
            raise InvalidStateError("a call has a timing once it is over")
        return self._timing

    def done(self) -> bool:
        """Whether it has ended."""
        return self._is_inherited or super().done()

    def result(self, timeout: float | None = None) -> ReplyT:
        """The reply, as soon as it is there; raises what the call ended with."""
        if not self._is_inherited:
            return super().result(timeout)
        if self._reply is None:
            raise self._inherited_error()
        return self._reply

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """What the call ended with, if not with a reply."""
        if not self._is_inherited:
            return super().exception(timeout)
        return self._inherited_error() if self._reply is None else None

    def succeed(self, reply: ReplyT, timing: Timing) -> None:
        """End with a reply, unless the caller has cancelled."""
        self._timing = timing
        if self.set_running_or_notify_cancel():
            self._reply = reply
            self.set_result(reply)

    def fail(self, error: Exception, timing: Timing) -> None:
        """End with an error, unless the caller has cancelled."""
        self._timing = timing
        if self.set_running_or_notify_cancel():
            self._error = error
            self.set_exception(error)

    @property
    def _is_inherited(self) -> bool:
        """Whether this process was forked from the one that made the call.

        Here the future's own lock may be held for ever, by a thread that there is only there.
        """
        return self._process != os.getpid()

    def _inherited_error(self) -> Exception:
        return self._error or ClientClosed(
            f"the call was made in process {self._process}, of which this one was forked before it was answered; "
            "make it again here"
        )
