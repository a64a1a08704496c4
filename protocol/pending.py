"""A reply that is under way, and where its time went."""

from concurrent.futures import Future, InvalidStateError

from msgspec import Struct

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
    """A future of a reply. It always ends by its call's deadline, with the reply or a typed error."""

    _timing: Timing | None = None

    @property
    def timing(self) -> Timing:
        """Where the time went.

        Raises:
            InvalidStateError: the call is not over.
        """
        if self._timing is None:
            raise InvalidStateError("a call has a timing once it is over")
        return self._timing

    def succeed(self, reply: ReplyT, timing: Timing) -> None:
        """End with a reply, unless the caller has cancelled."""
        self._timing = timing
        if self.set_running_or_notify_cancel():
            self.set_result(reply)

    def fail(self, error: Exception, timing: Timing) -> None:
        """End with an error, unless the caller has cancelled."""
        self._timing = timing
        if self.set_running_or_notify_cancel():
            self.set_exception(error)
