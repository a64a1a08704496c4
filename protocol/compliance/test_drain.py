"""How a worker ends on request. These rules come last, and only with `--drain`, since they end the worker."""

import pytest

from protocol.compliance.wire import Wire
from protocol.compliance.work import Work
from protocol.messages import Drain, Drained, Failure, Ping, Pong, State

_UNDER_WAY = 8


@pytest.fixture(autouse=True)
def still_there() -> None:
    """Replaces the check that the worker still answers, since these tests end it."""


def test_drain_finishes_what_is_in_hand_and_takes_no_more(wire: Wire, work: Work) -> None:
    """After Drain, requests in hand are answered as usual, new ones by a retryable `draining`, and then comes Drained.

    A supervisor recycles a worker like this, and no client loses anything: a refused request goes to another worker at
    once. Pings are answered meanwhile, with the state draining. After Drained, the process ends, and its connections
    with it.
    """
    in_hand = {wire.ask(request): request for request in map(work.large, range(_UNDER_WAY))}
    drain, refused, ping = wire.ask(Drain()), wire.ask(work.small()), wire.ask(Ping())
    answers = wire.answers({*in_hand, drain, refused, ping})
    replies = {answer.header.request: answer.message for answer in answers}

    failure, pong = replies[refused], replies[ping]
    assert isinstance(failure, Failure), f"new work was answered by {type(failure).__name__}"
    assert (failure.code, failure.retryable) == ("draining", True)
    assert isinstance(pong, Pong)
    assert pong.state is State.DRAINING
    for number, request in in_hand.items():
        assert work.answers(replies[number], request), replies[number]
    assert isinstance(replies[drain], Drained)
    assert answers[-1].message is replies[drain], "Drained came while work was still in hand"
    wire.wait_for_the_end()
