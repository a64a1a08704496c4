"""Messages that break a rule of docs/protocol.md, one each: the worker says so, and goes on."""

from collections.abc import Callable
from typing import Any, TypeAlias

import msgspec
import pytest

from protocol.compliance.wire import Answer, Connect, Wire, changed, parts_of
from protocol.compliance.work import Work, frame_to_perceive
from protocol.message import Request
from protocol.messages import Failure, Ping

Parts: TypeAlias = list[bytes]
Spoil: TypeAlias = Callable[[Parts], Parts]

_UNREADABLE = {"malformed-message", "limit-exceeded", "unsupported"}
"""What a Failure may call such a message: a worker that does not answer the request at all need not look into it."""


def _prelude(part: bytes) -> Spoil:
    return lambda parts: [part, *parts[1:]]


def _header(part: bytes) -> Spoil:
    return lambda parts: [parts[0], part, *parts[2:]]


def _header_field(name: str, value: Any) -> Spoil:
    return lambda parts: [parts[0], changed(parts[1], lambda fields: fields.update({name: value})), *parts[2:]]


def _body(part: bytes) -> Spoil:
    return lambda parts: [*parts[:2], part, *parts[3:]]


def _depth(**changes: Any) -> Spoil:
    """Another description of the frame's depths, whose part is the second array part."""

    def change(fields: dict[str, Any]) -> None:
        fields["frame"]["depth"] |= changes

    return lambda parts: [*parts[:2], changed(parts[2], change), *parts[3:]]


def _depth_without_elements(*shape: int) -> Spoil:
    def spoil(parts: Parts) -> Parts:
        parts = _depth(shape=shape)(parts)
        return [*parts[:4], b"", *parts[5:]]

    return spoil


ENVELOPES: dict[str, Spoil] = {
    "an empty part": lambda parts: [b""],
    "a prelude alone": lambda parts: parts[:1],
    "no body": lambda parts: parts[:2],
    "an empty prelude": _prelude(b""),
    "a prelude of 3 bytes": _prelude(b"\1\0\3"),
    "a prelude of 5 bytes": _prelude(b"\1\0\3\0\0"),
    "an empty header": _header(b""),
    "a header that is no msgpack": _header(b"\xc1\xff\xfe"),
    "a header that is no map": _header(msgspec.msgpack.encode([1, "x", 2.0])),
    "a header that announces 4 billion entries": _header(b"\xdf\xff\xff\xff\xff"),
    "a header nested without end": _header(b"\x81\xa1x" + b"\x91" * 4000),
    "a header without a deadline": _header(msgspec.msgpack.encode({"request": 1, "incarnation": "x"})),
    "a negative id": _header_field("request", -1),
    "an id of 64 bits": _header_field("request", 2**63),
    "a fractional id": _header_field("request", 1.5),
    "an id that is text": _header_field("request", "1"),
    "a negative deadline": _header_field("deadline", -1.0),
    "a deadline that is no number": _header_field("deadline", float("nan")),
    "an endless incarnation": _header_field("incarnation", "x" * 65),
}
"""The worker may not know whose reply a Failure would be, so it may be silent."""

BODIES: dict[str, Spoil] = {
    "an empty body": _body(b""),
    "a body that is no msgpack": _body(b"\xc1"),
    "a body that is no map": _body(msgspec.msgpack.encode([1, 2, 3])),
    "a body without its fields": _body(b"\x80"),
    "a body that is cut off": lambda parts: [*parts[:2], parts[2][:-3], *parts[3:]],
    "a body that announces 4 billion entries": _body(b"\xdf\xff\xff\xff\xff"),
    "a body nested without end": _body(b"\x81\xa5scene" + b"\x91" * 100_000),
    "text that is no UTF-8": _body(b"\x81\xa5scene\xa2\xff\xfe"),
    "an unknown message number": _prelude(b"\1\0\xe7\3"),
}
"""Spoilt work of the worker's own role."""

ARRAYS: dict[str, Spoil] = {
    "an array part that is not there": lambda parts: parts[:-1],
    "an array part that no field describes": lambda parts: [*parts, b"more"],
    "an array part described twice": _depth(index=0),
    "an index past the parts": _depth(index=99),
    "a negative index": _depth(index=-1),
    "a shape larger than its part": _depth(shape=[24, 33]),
    "a shape smaller than its part": _depth(shape=[24, 31]),
    "a shape of other dimensions": _depth(shape=[24 * 32]),
    "a negative length": _depth(shape=[-24, -32]),
    "a shape whose size is 0 in 64 bits": _depth_without_elements(2**32, 2**30),
    "an empty array of endless shape": _depth_without_elements(0, 2**62),
    "elements that are objects": _depth(dtype="object"),
    "big-endian elements": _depth(dtype=">f4"),
    "another element type than the field's": _depth(dtype="int32"),
    "a part of another length": lambda parts: [*parts[:4], parts[4][:-1], *parts[5:]],
    "a bool that is 2": lambda parts: [*parts[:6], bytes([2] * 18), *parts[7:]],
}
"""A spoilt Perceive."""


@pytest.mark.parametrize("spoil", ENVELOPES.values(), ids=ENVELOPES.keys())
def test_a_message_that_can_t_be_told_apart_is_refused_or_passed_over(wire: Wire, work: Work, spoil: Spoil) -> None:
    """A message whose prelude or header is broken is answered by a Failure or not at all, and the worker goes on.

    Any program that can reach the address may send such a message: a port scanner, a browser.
    """
    wire.send(spoil(parts_of(work.small(), wire.next_number())))
    assert all(_is_refusal(answer) for answer in wire.answers_before_a_ping())


@pytest.mark.parametrize("spoil", BODIES.values(), ids=BODIES.keys())
def test_a_body_that_can_t_be_read_is_told_its_sender(wire: Wire, work: Work, spoil: Spoil) -> None:
    """Where the header can be read but the rest can't, the answer is `malformed-message`, not silence.

    The sender would wait until its deadline for a mistake that every further try repeats.
    """
    number = wire.next_number()
    wire.send(spoil(parts_of(work.small(), number)))
    assert _is_refusal(answer := wire.answer(number)), answer.message


@pytest.mark.parametrize("spoil", ARRAYS.values(), ids=ARRAYS.keys())
def test_an_array_that_is_not_as_described_is_told_its_sender(wire: Wire, spoil: Spoil) -> None:
    """Element type, shape, index and length of every array are checked; what does not fit is `malformed-message`.

    Sizes are computed without overflow and before anything is allocated: an array from outside must not be read past
    its end.
    """
    number = wire.next_number()
    wire.send(spoil(parts_of(frame_to_perceive(), number)))
    assert _is_refusal(answer := wire.answer(number)), answer.message


def test_garbage_is_counted(wire: Wire) -> None:
    """`malformed` in a pong counts unreadable messages, so that an operator can look for their sender."""
    before = wire.ping().malformed
    wire.send([b"", b"", b""])
    wire.send([b"no", b"message"])
    assert wire.ping().malformed >= before + 2


def test_garbage_between_requests_costs_no_reply(wire: Wire, connect: Connect, work: Work) -> None:
    """What one client spoils costs no other client, and not itself, a reply."""
    other = connect()
    asked: dict[int, Request[Any]] = {}
    for tag, spoil in enumerate([*ENVELOPES.values()][:8]):
        asked[other.ask(work.small(tag))] = work.small(tag)
        wire.send(spoil(parts_of(Ping(), wire.next_number())))
    assert all(work.answers(answer.message, asked[answer.header.request]) for answer in other.answers(asked))
    request = work.small()
    number = wire.ask(request, number=10_000)
    assert work.answers(wire.answer(number).message, request)


def _is_refusal(answer: Answer) -> bool:
    failure = answer.message
    return isinstance(failure, Failure) and failure.code in _UNREADABLE and not failure.retryable
