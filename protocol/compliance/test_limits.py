"""Limits: a worker refuses what exceeds them, so that no client can exhaust its memory."""

from collections.abc import Callable

import pytest

from protocol.compliance.wire import Connect, Wire, changed, parts_of
from protocol.compliance.work import Work
from protocol.limits import DEFAULT_LIMITS, KIB, MIB
from protocol.messages import Failure

_FLOOD = 4 * DEFAULT_LIMITS.queue
_FLOOD_DEADLINE = 1.0
"""Seconds: requests that still wait after that need not be computed for this test."""

_TOO_LARGE: dict[str, Callable[[list[bytes]], list[bytes]]] = {
    "a header": lambda parts: [parts[0], _with_text(parts[1], 8 * KIB), *parts[2:]],
    "a body": lambda parts: [*parts[:2], _with_text(parts[2], 2 * MIB), *parts[3:]],
    "too many arrays": lambda parts: [*parts, *[b"x"] * (DEFAULT_LIMITS.arrays + 1)],
    "far too many parts": lambda parts: [*parts, *[b"x"] * 2000],
    "an array": lambda parts: [*parts, bytes(64 * MIB + 1)],
}


@pytest.mark.parametrize("enlarge", _TOO_LARGE.values(), ids=_TOO_LARGE.keys())
def test_what_is_too_large_is_refused(
    wire: Wire, connect: Connect, work: Work, enlarge: Callable[[list[bytes]], list[bytes]]
) -> None:
    """Past the limits of docs/protocol.md the answer is `limit-exceeded`, or the connection's end; never work.

    A part that is larger than any may be is best refused by the socket itself (ZMQ_MAXMSGSIZE), before it is in
    memory. Other clients do not notice.
    """
    other = connect()
    other.ping()
    wire.send(enlarge(parts_of(work.small(), wire.next_number())))
    failure = wire.refusal()
    assert failure is None or failure.code in ("limit-exceeded", "malformed-message"), failure
    request = work.small()
    assert work.answers(other.call(request), request)


def test_more_requests_than_a_worker_takes_are_refused_at_once(wire: Wire, connect: Connect, work: Work) -> None:
    """A worker has a bounded number of requests in hand, 64 by default; the next are refused by `overloaded`.

    Each of the 256 that the suite sends is answered once: by its reply, by `overloaded`, or by its deadline. A queue
    without bound makes every client late and ends with the machine's memory.
    """
    asked = {wire.ask(work.small(tag % 100), deadline=_FLOOD_DEADLINE): tag % 100 for tag in range(_FLOOD)}
    connect().ping()
    codes: list[str] = []
    for answer in wire.answers(asked):
        if isinstance(answer.message, Failure):
            codes.append(answer.message.code)
            assert answer.message.retryable == (answer.message.code == "overloaded"), answer.message
        else:
            assert work.answers(answer.message, work.small(asked[answer.header.request]))
    assert set(codes) <= {"overloaded", "deadline-exceeded"}
    assert "overloaded" in codes, f"{_FLOOD} requests at once, and none was refused"
    wire.wait_until(lambda pong: pong.queue_depth == 0)


def test_an_overload_passes(wire: Wire, work: Work) -> None:
    """Once the requests in hand are answered, new ones are taken again."""
    wire.answers([wire.ask(work.small(tag % 100), deadline=0.0) for tag in range(_FLOOD)])
    request = work.small()
    assert work.answers(wire.call(request), request)


def _with_text(part: bytes, length: int) -> bytes:
    return changed(part, lambda fields: fields.update(added_later="x" * length))
