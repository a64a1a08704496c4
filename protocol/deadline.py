"""How long the request that a handler is answering may still take.

A handler that calls another worker inherits its own caller's deadline, so nobody computes for someone who has given up.
"""

import time
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

_expiry: ContextVar[float] = ContextVar("expiry")


@contextmanager
def deadline(seconds: float) -> Generator[None]:
    """Bound all calls made inside, in this thread."""
    token = _expiry.set(time.monotonic() + remaining(seconds))
    try:
        yield
    finally:
        _expiry.reset(token)


def remaining(otherwise: float) -> float:
    """Seconds until the surrounding deadline, or `otherwise` if that is sooner or there is none."""
    expiry = _expiry.get(None)
    return otherwise if expiry is None else min(otherwise, expiry - time.monotonic())
