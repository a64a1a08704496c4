"""The future of a reply, and the time that its call took."""

import os
from concurrent.futures import Future, InvalidStateError

from msgspec import Struct

from protocol.errors import ClientClosed
from protocol.message import ReplyT


class Timing(Struct, frozen=True):
    """Seconds of one call: `wall` from submission to reply, of which `queue` and `compute` passed in the worker."""

    wall: float
    queue: float = 0.0
    compute: float = 0.0

    @property
    def transport(self) -> float:
        """The rest: encoding, sockets, threads, and failed tries."""
        return self.wall - self.queue - self.compute


class Pending(Future[ReplyT]):
    """The future of a reply. It ends by its call's deadline, with the reply or a typed error.

    In a process that is forked meanwhile it ends at once with `ClientClosed`, since no thread there receives the reply.
    """

    _timing: Timing | None = None

    def __init__(self) -> None:
        super().__init__()
        self._process = os.getpid()
        self._reply: ReplyT | None = None
        self._error: Exception | None = None

    @property
    def timing(self) -> Timing:
        """The time that the call took.

        Raises:
            InvalidStateError: the call has not ended.
        """
        if self._timing is None:
            raise InvalidStateError("a call has a timing once it has ended")
        return self._timing

    def done(self) -> bool:
        """Whether the call has ended."""
        return self._is_inherited or super().done()

    def result(self, timeout: float | None = None) -> ReplyT:
        """Wait for the reply; raises the error that the call ended with."""
        if not self._is_inherited:
            return super().result(timeout)
        if self._reply is None:
            raise self._inherited_error()
        return self._reply

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Wait for the end; the error that the call ended with, or None."""
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

        In this process the future's own lock may never be released: the thread that held it exists only in the other.
        """
        return self._process != os.getpid()

    def _inherited_error(self) -> Exception:
        return self._error or ClientClosed(
            f"the call was made in process {self._process}, and this process was forked before the reply came; "
            "make the call again here"
        )
