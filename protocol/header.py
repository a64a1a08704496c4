"""The header of every message, which is read before its body.

Deadlines are relative, since the clocks of two machines differ; the time of the transport is not subtracted.
"""

from typing import Annotated, Any, TypeAlias

from msgspec import Meta, Struct

from protocol.quantities import Seconds

RequestId: TypeAlias = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Incarnation: TypeAlias = Annotated[str, Meta(max_length=64)]


class RequestHeader(Struct, frozen=True):
    """`request` identifies one try of one request; `deadline` is how many seconds its sender still waits."""

    request: RequestId
    incarnation: Incarnation
    deadline: Seconds


class RequestNumber(Struct, frozen=True):
    """The part of a request's header that is needed to answer it; the header of a reply has no deadline."""

    request: RequestId
    deadline: Any


class ReplyHeader(Struct, frozen=True):
    """`request` is that of the request; `queue` and `compute` are the seconds that it waited and took in the worker."""

    request: RequestId
    incarnation: Incarnation
    queue: Seconds = 0.0
    compute: Seconds = 0.0
