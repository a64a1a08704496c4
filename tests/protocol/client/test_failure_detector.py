import pytest

from protocol.client.failure_detector import Pulse, Suspicion
from protocol.messages import Pong, State
from protocol.timeouts import Timeouts

TIMEOUTS = Timeouts(heartbeat=0.5, liveness=2.0, progress=3.0)


def pong(progress: int = 0) -> Pong:
    return Pong(incarnation="x", state=State.BUSY, progress=progress, queue_depth=1, resident_bytes=1)


def beat(pulse: Pulse, times: int, *, progress: int = 0, holds_calls: bool = True) -> None:
    """Ping and pong."""
    for _ in range(times):
        pulse.asked()
        pulse.heard()
        pulse.answered(pong(progress), holds_calls=holds_calls)


def test_a_worker_is_silent_once_as_many_pings_went_unanswered_as_liveness_has_heartbeats():
    pulse = Pulse(0.5, TIMEOUTS)
    for _ in range(4):
        pulse.asked()
    assert pulse.suspicion is None
    pulse.asked()
    assert pulse.suspicion is Suspicion.SILENT


def test_a_word_ends_a_silence():
    pulse = Pulse(0.5, TIMEOUTS)
    for _ in range(10):
        pulse.asked()
    pulse.heard()
    assert pulse.suspicion is None


@pytest.mark.parametrize(("heartbeat", "pings"), [(0.5, 4), (1.0, 2), (2.0, 2), (10.0, 2)])
def test_a_worker_with_a_slower_heartbeat_has_more_time(heartbeat, pings):
    pulse = Pulse(heartbeat, TIMEOUTS)
    for _ in range(pings):
        pulse.asked()
    assert pulse.suspicion is None
    pulse.asked()
    assert pulse.suspicion is Suspicion.SILENT


def test_a_worker_is_stuck_when_its_counter_stands_still_while_it_holds_calls():
    pulse = Pulse(0.5, TIMEOUTS)
    beat(pulse, 7)
    assert pulse.suspicion is None
    beat(pulse, 1)
    assert pulse.suspicion is Suspicion.STUCK


def test_a_slow_worker_is_not_stuck():
    pulse = Pulse(0.5, TIMEOUTS)
    for progress in range(10):
        beat(pulse, 6, progress=progress)
    assert pulse.suspicion is None


def test_a_worker_that_answers_and_does_not_count_is_not_stuck():
    pulse = Pulse(0.5, TIMEOUTS)
    for _ in range(10):
        beat(pulse, 5)
        pulse.moved()
    assert pulse.suspicion is None


def test_a_worker_that_holds_nothing_is_not_stuck():
    pulse = Pulse(0.5, TIMEOUTS)
    beat(pulse, 100, holds_calls=False)
    beat(pulse, 6)
    assert pulse.suspicion is None


def test_a_worker_whose_calls_are_given_up_one_after_the_other_is_stuck_all_the_same():
    pulse = Pulse(0.5, TIMEOUTS)
    beat(pulse, 1)
    for _ in range(3):
        beat(pulse, 2)
        beat(pulse, 10, holds_calls=False)
    assert pulse.suspicion is Suspicion.STUCK


def test_pongs_that_come_all_at_once_count_as_one():
    pulse = Pulse(0.5, TIMEOUTS)
    beat(pulse, 1)
    for _ in range(100):
        pulse.answered(pong(), holds_calls=True)
    beat(pulse, 1)
    assert pulse.suspicion is None


def test_a_stuck_worker_stays_so_when_nobody_waits_for_it_any_more_until_it_gets_on():
    pulse = Pulse(0.5, TIMEOUTS)
    beat(pulse, 8)
    beat(pulse, 10, holds_calls=False)
    assert pulse.suspicion is Suspicion.STUCK
    beat(pulse, 1, progress=1, holds_calls=False)
    assert pulse.suspicion is None
