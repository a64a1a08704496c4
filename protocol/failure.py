"""Errors on the wire: a worker's exception becomes a `Failure`, and a `Failure` becomes a client's exception."""

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
    """The stable code of an error: `invalid-input` for `InvalidInput`.

    An impossible value has the same code whether the codec or a handler found it.
    """
    if issubclass(kind, ImpossibleValue):
        return INVALID_INPUT
    return re.sub(r"(?<!^)(?=[A-Z])", "-", kind.__name__).lower()


def failure_of(error: Exception) -> Failure:
    """The reply of a worker whose handler raised an error."""
    message = readable(str(error)[:_LONGEST_MESSAGE])
    if isinstance(error, Rejected):
        return Failure(code=error.code, message=message, retryable=error.retryable)
    if isinstance(error, VantageError):
        # A worker that this one called was lost or late; the next try may succeed.
        return Failure(code=code_of(type(error)), message=message, retryable=isinstance(error, CallFailed))
    return internal(f"{type(error).__name__}: {message}")


def error_of(failure: Failure, worker: str, request: str) -> VantageError:
    """The error that a client raises for a worker's failure."""
    if failure.code == VERSION_MISMATCH:
        return VersionMismatch(f"{worker} and this process speak no common version: {failure.message}")
    return Rejected(
        f"{worker} rejected {request} ({failure.code}): {failure.message}",
        code=failure.code,
        retryable=failure.retryable,
    )


def internal(message: str) -> Failure:
    """An error in the worker itself."""
    return Failure(code="internal", message=message)


def draining() -> Failure:
    """The worker is about to end and takes no new requests."""
    return Failure(code=DRAINING, message="the worker is about to end; send the request to another", retryable=True)


def overloaded(queue: int) -> Failure:
    """The worker's queue is full."""
    message = f"{queue} requests are in hand already; try again, or start more workers"
    return Failure(code=OVERLOADED, message=message, retryable=True)
