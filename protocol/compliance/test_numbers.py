"""Impossible numbers in scenes, cameras and filters: refused by name, before anything is computed from them."""

from collections.abc import Iterable
from itertools import islice, product
from typing import Any

from msgspec import Struct

from protocol.catalogue import Message
from protocol.compliance.numbers import IMPOSSIBLE, ODD, Number, numbers_of, with_number
from protocol.compliance.wire import Wire, parts_of
from protocol.compliance.work import Work
from protocol.message import Request
from protocol.messages import Failure

_AT_ONCE = 32
"""Requests under way at once: so few that no worker is overloaded."""

_REFUSALS = ("invalid-input", "malformed-message", "limit-exceeded")

_READINGS = "depth"
"""A sensor's: 0 or not finite where nothing was measured."""


class _Outcome(Struct, frozen=True, eq=False):
    """The outcome of a request with one number replaced."""

    number: Number
    value: float
    reply: Message

    @property
    def words(self) -> str:
        """The outcome as text, for messages."""
        reply = self.reply
        said = f"{reply.code}: {reply.message}" if isinstance(reply, Failure) else type(reply).__name__
        return f"{self.number.words} = {self.value:g}: {said}"


def test_a_number_that_can_t_be_is_refused_by_name(wire: Wire, work: Work) -> None:
    """NaN, an infinity or 1e300 in a scene, a camera or a filter is answered by `invalid-input` that names the field.

    No picture is drawn of a scene that can't be, and no filter goes back that stays NaN for the rest of a flight. What
    is no integer in an integer's place may be `malformed-message` as well. Depth is a sensor's: it may be anything.
    """
    outcomes = _outcomes(wire, work.small(), IMPOSSIBLE)
    assert [one.words for one in outcomes if one.number.field != _READINGS and not _is_refused_by_name(one)] == []


def test_any_number_brings_an_answer_or_a_refusal(wire: Wire, work: Work) -> None:
    """Each number of each request of the role, set to NaN, ±inf, ±1e300, 0 and -1 in turn, is answered or refused.

    Never by `internal`, which is for a worker's own mistakes, and never late. No answer has a NaN where there is always
    a number: this suite's codec refuses it by name.
    """
    for request in work.full():
        outcomes = _outcomes(wire, request, ODD)
        assert [one.words for one in outcomes if not _is_answered_or_refused(one)] == [], type(request).__name__


def _outcomes(wire: Wire, request: Request[Any], values: Iterable[float]) -> list[_Outcome]:
    """What comes of a request for each of its numbers and each value; a few of them are under way at once."""
    parts = parts_of(request, 0)
    odd = ((number, value) for number, value in product(numbers_of(parts), values) if number.value != value)
    outcomes: list[_Outcome] = []
    while batch := list(islice(odd, _AT_ONCE)):
        asked = {wire.next_number(): one for one in batch}
        for identity, (number, value) in asked.items():
            wire.send(with_number(parts_of(request, identity), number, value))
        outcomes += [_Outcome(*asked[answer.header.request], answer.message) for answer in wire.answers(asked)]
    return outcomes


def _is_refused_by_name(one: _Outcome) -> bool:
    reply, codes = one.reply, _REFUSALS if one.number.whole else _REFUSALS[:1]
    if not isinstance(reply, Failure) or reply.retryable:
        return False
    return reply.code in codes and one.number.field in reply.message


def _is_answered_or_refused(one: _Outcome) -> bool:
    return not isinstance(one.reply, Failure) or (one.reply.code in _REFUSALS and not one.reply.retryable)
