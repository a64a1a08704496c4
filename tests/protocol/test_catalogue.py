"""Numbers and messages stand for each other, and every request names its reply."""

import pytest

from protocol import frame, messages, pose_estimate
from protocol.catalogue import message_type, reply_type
from protocol.errors import MalformedMessage
from protocol.frame import Frame
from protocol.message import Reply, Request
from protocol.messages import MESSAGE_NUMBERS, Hello, Observe, Perceive, Ping, Pong, Render, Welcome
from protocol.pose_estimate import PoseEstimate


def test_every_message_has_a_number_of_its_own_that_fits_two_bytes():
    assert len(set(MESSAGE_NUMBERS.values())) == len(MESSAGE_NUMBERS)
    assert all(0 < number < 2**16 for number in MESSAGE_NUMBERS.values())
    assert all(message_type(number) is kind for kind, number in MESSAGE_NUMBERS.items())


def test_every_message_that_is_written_is_numbered():
    written = {
        kind
        for module in (messages, frame, pose_estimate)
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, Request | Reply)
    }
    assert written - {Request, Reply} == set(MESSAGE_NUMBERS)


@pytest.mark.parametrize(
    ("request_type", "answer"),
    [(Hello, Welcome), (Ping, Pong), (Render, Frame), (Perceive, PoseEstimate), (Observe, PoseEstimate)],
)
def test_a_request_names_its_reply(request_type, answer):
    assert reply_type(request_type) is answer


def test_every_reply_that_a_request_names_is_numbered():
    requests = [kind for kind in MESSAGE_NUMBERS if issubclass(kind, Request)]
    assert all(reply_type(kind) in MESSAGE_NUMBERS for kind in requests)


def test_an_unknown_number_is_malformed():
    with pytest.raises(MalformedMessage):
        message_type(0)


def test_a_request_that_names_no_reply_is_told():
    class Aimless(Request):
        pass

    with pytest.raises(MalformedMessage, match="Aimless does not name its reply"):
        reply_type(Aimless)
