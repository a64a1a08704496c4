"""What a worker holds is told apart by its request's id, and goes to another where that may answer it."""

import pytest

from protocol.client.call import Call
from protocol.client.held_calls import HeldCalls
from protocol.client.pending import Pending
from protocol.codec import Payload
from protocol.messages import Pong, Sampled


def call(*, at_once: bool = False) -> Call:
    return Call(
        request="Ping" if at_once else "SampleScene",
        payload=Payload(number=0, body=b"", arrays=()),
        reply=Pong if at_once else Sampled,
        submitted=0.0,
        timeout=1.0,
        pending=Pending(),
        at_once=at_once,
    )


WORK, MORE_WORK, PING = call(), call(), call(at_once=True)


@pytest.fixture
def held() -> HeldCalls:
    held = HeldCalls()
    for number, one in enumerate((WORK, PING, MORE_WORK)):
        held.add(number, one)
    return held


def test_a_reply_is_given_the_call_with_its_id_once(held):
    assert held.answered(2) is MORE_WORK
    assert held.answered(2) is None
    assert len(held) == 2
    assert MORE_WORK not in held


def test_what_needs_a_handler_may_be_taken_to_another_worker_in_the_order_in_which_it_was_sent(held):
    assert held.take_movable() == [WORK, MORE_WORK]
    assert PING in held
    assert not held.need_a_handler


def test_a_call_that_has_ended_is_held_no_more(held):
    held.forget(WORK)
    held.forget(call())
    assert held.take_all() == [PING, MORE_WORK]
    assert len(held) == 0
