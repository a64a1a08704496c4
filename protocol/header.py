"""What every message says about itself, before its body is looked at.

Deadlines are relative, since the clocks of two machines differ; the time on the way counts in the sender's favour.
"""

from typing import Annotated, Any, TypeAlias

from msgspec import Meta, Struct

from protocol.quantities import Seconds

RequestId: TypeAlias = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Incarnation: TypeAlias = Annotated[str, Meta(max_length=64)]


class RequestHeader(Struct, frozen=True):
    """`request` names one try of one request; `deadline` is how many seconds its sender still waits."""

    request: RequestId
    incarnation: Incarnation
    deadline: Seconds


class RequestNumber(Struct, frozen=True):
    """What must be read of a request's header to answer it, whatever else is in there; a reply's has no deadline."""

    request: RequestId
    deadline: Any


class ReplyHeader(Struct, frozen=True):
    """`request` is the request's; `queue` and `compute` are the seconds that it waited and took in the worker."""

    request: RequestId
    incarnation: Incarnation
    queue: Seconds = 0.0
    compute: Seconds = 0.0
