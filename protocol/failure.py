"""Errors on the wire: what a worker raises becomes a `Failure`, and a `Failure` becomes what a client raises."""

import re

from protocol.errors import CallFailed, ImpossibleValue, Rejected, VantageError, VersionMismatch
from protocol.messages import Failure
from protocol.text import readable

_LONGEST_MESSAGE = 2000

VERSION_MISMATCH = "version-mismatch"
OVERLOADED = "overloaded"
DRAINING = "draining"
INVALID_INPUT = "invalid-input"


def code_of(kind: type[Exception]) -> str:
    """The stable word for an error: `invalid-input` for `InvalidInput`.

    To whoever sent it, a value that can't be is the same, whether the codec or a handler found it.
    """
    if issubclass(kind, ImpossibleValue):
        return INVALID_INPUT
    return re.sub(r"(?<!^)(?=[A-Z])", "-", kind.__name__).lower()


def failure_of(error: Exception) -> Failure:
    """What a worker answers when a handler raises."""
    message = readable(str(error)[:_LONGEST_MESSAGE])
    if isinstance(error, Rejected):
        return Failure(code=error.code, message=message, retryable=error.retryable)
    if isinstance(error, VantageError):
        # A worker behind this one was lost or late; it may be back at the next try.
        return Failure(code=code_of(type(error)), message=message, retryable=isinstance(error, CallFailed))
    return internal(f"{type(error).__name__}: {message}")


def error_of(failure: Failure, worker: str, request: str) -> VantageError:
    """What a client raises when a worker answers so."""
    if failure.code == VERSION_MISMATCH:
        return VersionMismatch(f"{worker} and this process speak no common version: {failure.message}")
    return Rejected(
        f"{worker} rejected {request} ({failure.code}): {failure.message}",
        code=failure.code,
        retryable=failure.retryable,
    )


def internal(message: str) -> Failure:
    """A worker's own fault."""
    return Failure(code="internal", message=message)


def draining() -> Failure:
    """A worker that is about to end takes no more."""
    return Failure(code=DRAINING, message="the worker is about to end; send the request elsewhere", retryable=True)


def overloaded(queue: int) -> Failure:
    """A worker has as much in hand as it takes."""
    message = f"{queue} requests are in hand already; try again, or start more workers"
    return Failure(code=OVERLOADED, message=message, retryable=True)
