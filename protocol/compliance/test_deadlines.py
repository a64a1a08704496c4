"""Every request ends by its deadline, with a reply or a Failure."""

import pytest

from protocol.compliance.wire import Wire
from protocol.compliance.work import Work
from protocol.messages import Failure

_UNDER_WAY = 8
_MOMENT = 0.001
"""Seconds: less than the work of earlier requests takes."""


def test_a_request_whose_deadline_has_passed_is_refused(wire: Wire, work: Work) -> None:
    """A request with no time left is answered by `deadline-exceeded`, not retryable, and not computed.

    Its sender has given up, and to compute it would only delay other requests.
    """
    failure = wire.call(work.small(), deadline=0.0)
    assert isinstance(failure, Failure), f"it was answered by {type(failure).__name__}"
    assert (failure.code, failure.retryable) == ("deadline-exceeded", False)


def test_a_deadline_that_passes_in_the_queue_is_told(wire: Wire, work: Work) -> None:
    """A request that waits behind others until its deadline is answered by `deadline-exceeded`.

    Those that it waited for are answered as usual.
    """
    before = {wire.ask(work.large(tag)) for tag in range(_UNDER_WAY)}
    late = wire.ask(work.small(), deadline=_MOMENT)
    answers = {answer.header.request: answer.message for answer in wire.answers({*before, late})}
    failure = answers[late]
    assert isinstance(failure, Failure), f"it was answered by {type(failure).__name__}"
    assert failure.code == "deadline-exceeded"
    assert not [answers[number] for number in before if isinstance(answers[number], Failure)]


@pytest.mark.parametrize("deadline", [_MOMENT, 1e9], ids=["a moment", "30 years"])
def test_no_deadline_makes_a_worker_silent(wire: Wire, work: Work, deadline: float) -> None:
    """A deadline that passes while the work is done, and one beyond all bounds, still bring an answer."""
    request = work.large()
    reply = wire.call(request, deadline=deadline)
    assert work.answers(reply, request) or (isinstance(reply, Failure) and reply.code == "deadline-exceeded")
