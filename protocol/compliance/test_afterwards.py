"""The worker after all other rules but Drain: the same process, and in order."""

from protocol.compliance.wire import Wire
from protocol.compliance.work import Work
from protocol.messages import State, Welcome


def test_it_is_still_the_same_process(wire: Wire, welcome: Welcome) -> None:
    """The incarnation is the one that it was at first.

    Nothing that the suite sent ended the process, not even for a moment in which a supervisor started it again.
    """
    assert wire.ping().incarnation == welcome.incarnation


def test_nothing_is_left_in_hand(wire: Wire) -> None:
    """Once no client waits, the worker is ready again and its queue empty; no request stays in it."""
    pong = wire.wait_until(lambda pong: pong.queue_depth == 0, seconds=60.0)
    assert pong.state is State.READY


def test_it_still_works(wire: Wire, work: Work) -> None:
    """It answers its work as before."""
    for request in (work.small(), work.large()):
        assert work.answers(wire.call(request), request)
