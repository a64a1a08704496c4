"""The two kinds of message: a request, which names the type of its answer, and a reply."""

from typing import Generic, TypeVar

from msgspec import Struct

from protocol.arrays import require_elements


class Value(Struct, frozen=True, eq=False):
    """Root of the structs that carry arrays; compared by identity, since arrays have no single truth value.

    `__post_init__` checks the arrays against the `Elements` in their annotations. A struct with further rules calls it
    first.
    """

    def __post_init__(self) -> None:
        require_elements(self)


class Reply(Value, frozen=True, eq=False):
    """Root of every reply."""


ReplyT = TypeVar("ReplyT", bound=Reply)
ReplyT_co = TypeVar("ReplyT_co", bound=Reply, covariant=True)


class Request(Value, Generic[ReplyT_co], frozen=True, eq=False):
    """Root of every request; `Request[Frame]` is answered by a `Frame`.

    Every request is pure: it carries everything that its reply depends on, so it may be sent again to any worker.
    """
