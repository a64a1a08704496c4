"""The message of each number, and the reply of each request."""

from functools import cache
from typing import Any, TypeAlias, get_args

from protocol.errors import MalformedMessage
from protocol.message import Reply, Request
from protocol.messages import MESSAGE_NUMBERS

Message: TypeAlias = Request[Any] | Reply
MessageType: TypeAlias = type[Request[Any]] | type[Reply]


@cache
def _types() -> dict[int, MessageType]:
    return {number: kind for kind, number in MESSAGE_NUMBERS.items()}


def message_type(number: int) -> MessageType:
    """The message with a number.

    Raises:
        MalformedMessage: this version knows no message with this number.
    """
    kind = _types().get(number)
    if kind is None:
        raise MalformedMessage(f"no message has the number {number}")
    return kind


@cache
def reply_type(request: type[Request[Any]]) -> type[Reply]:
    """The type of a request's reply: `Frame` for `Render`, which is a `Request[Frame]`."""
    for base in getattr(request, "__orig_bases__", ()):
        for argument in get_args(base):
            if isinstance(argument, type) and issubclass(argument, Reply):
                return argument
    raise MalformedMessage(f"{request.__name__} does not name its reply, as in Request[Frame]")
