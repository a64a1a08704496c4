"""How long the request that a handler answers may still take.

A handler's own calls inherit the deadline of its caller, so that no worker computes for a caller that has given up.
"""

import time
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

_expiry: ContextVar[float] = ContextVar("expiry")


@contextmanager
def deadline(seconds: float) -> Generator[None]:
    """Limit all calls made inside, in this thread, to so many seconds from now."""
    token = _expiry.set(time.monotonic() + remaining(seconds))
    try:
        yield
    finally:
        _expiry.reset(token)


def remaining(otherwise: float) -> float:
    """Seconds until the surrounding deadline; `otherwise` if that is sooner, or without a deadline."""
    expiry = _expiry.get(None)
    return otherwise if expiry is None else min(otherwise, expiry - time.monotonic())
