"""The two kinds of message: a request, which names the type of its answer, and a reply."""

from typing import Generic, TypeVar

from msgspec import Struct

from protocol.arrays import require_elements


class Value(Struct, frozen=True, eq=False):
    """Root of the structs that carry arrays; compared by identity, since arrays have no single truth value.

    Its arrays are held to the `Elements` that they are annotated with. Whoever has a rule of its own calls this first.
    """

    def __post_init__(self) -> None:
        require_elements(self)


class Reply(Value, frozen=True, eq=False):
    """Root of every answer."""


ReplyT = TypeVar("ReplyT", bound=Reply)
ReplyT_co = TypeVar("ReplyT_co", bound=Reply, covariant=True)


class Request(Value, Generic[ReplyT_co], frozen=True, eq=False):
    """Root of every question; `Request[Frame]` is answered by a `Frame`.

    Every request is pure: it carries all that its answer depends on, so it may be sent again to any worker.
    """
