"""Ping and Pong: whether the process is alive, and whether its work makes progress."""

from protocol.compliance.wire import Connect, Wire
from protocol.compliance.work import Work
from protocol.messages import Ping, Pong, State

_UNDER_WAY = 8
"""Large requests that are enough to keep a worker busy while a ping comes."""


def test_pings_are_answered_while_work_is_computed(wire: Wire, work: Work) -> None:
    """A ping is answered at once, before earlier requests are, also while handlers compute.

    A client that gets no pong for `timeouts.liveness` takes the worker for dead; a slow picture must not look like
    that.
    """
    asked = {wire.ask(work.large(tag)) for tag in range(_UNDER_WAY)}
    ping = wire.ask(Ping())
    order = [answer.header.request for answer in wire.answers({*asked, ping})]
    assert order[-1] != ping, "the pong came only after all the work that was asked for before it"


def test_another_client_s_work_keeps_no_ping_waiting(wire: Wire, connect: Connect, work: Work) -> None:
    """A ping is answered at once on a connection that holds no work, too."""
    asked = {wire.ask(work.large(tag)) for tag in range(_UNDER_WAY)}
    connect().ping()
    assert len(wire.answers(asked)) == _UNDER_WAY


def test_a_pong_says_how_much_is_in_hand(wire: Wire, work: Work) -> None:
    """While requests are in hand `queue_depth` is above 0 and `state` is busy; afterwards they are 0 and ready.

    A supervisor kills a worker as hung when it has work in hand and answers none of it: it must know which.
    """
    wire.wait_until(_is_idle)
    asked = {wire.ask(work.large(tag)) for tag in range(_UNDER_WAY)}
    ping = wire.ask(Ping())
    answers = wire.answers({*asked, ping})
    pong = next(answer.message for answer in answers if answer.header.request == ping)
    assert isinstance(pong, Pong)
    if answers[-1].message is not pong:
        assert pong.state is State.BUSY
        assert 0 < pong.queue_depth <= _UNDER_WAY
    wire.wait_until(_is_idle)


def test_progress_counts_the_replies(wire: Wire, work: Work) -> None:
    """`progress` has grown by at least one for each reply that was sent, and never goes back.

    It is the third clock: pings are answered by a thread of their own, so only this tells a hung handler from a slow
    one.
    """
    before = wire.ping().progress
    asked = {wire.ask(work.small(tag)) for tag in range(_UNDER_WAY)}
    wire.answers(asked)
    after = wire.wait_until(lambda pong: pong.progress >= before + _UNDER_WAY)
    assert wire.ping().progress >= after.progress


def test_a_pong_says_how_much_memory_the_process_has(wire: Wire) -> None:
    """`resident_bytes` is above 0: a worker that grows is recycled by it."""
    assert wire.ping().resident_bytes > 0


def _is_idle(pong: Pong) -> bool:
    return pong.state is State.READY and pong.queue_depth == 0
