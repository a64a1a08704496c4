import pytest

from protocol.client.failure_detector import FailureDetector, Suspicion
from protocol.messages import Pong, State
from protocol.timeouts import Timeouts

TIMEOUTS = Timeouts(heartbeat=0.5, liveness=2.0, progress=3.0)


def pong(progress: int = 0) -> Pong:
    return Pong(incarnation="x", state=State.BUSY, progress=progress, queue_depth=1, resident_bytes=1)


def beat(detector: FailureDetector, times: int, *, progress: int = 0, holds_calls: bool = True) -> None:
    """Ping and pong."""
    for _ in range(times):
        detector.asked()
        detector.heard()
        detector.answered(pong(progress), holds_calls=holds_calls)


def test_a_worker_is_silent_once_as_many_pings_went_unanswered_as_liveness_has_heartbeats():
    detector = FailureDetector(0.5, TIMEOUTS)
    for _ in range(4):
        detector.asked()
    assert detector.suspicion is None
    detector.asked()
    assert detector.suspicion is Suspicion.SILENT


def test_a_word_ends_a_silence():
    detector = FailureDetector(0.5, TIMEOUTS)
    for _ in range(10):
        detector.asked()
    detector.heard()
    assert detector.suspicion is None


@pytest.mark.parametrize(("heartbeat", "pings"), [(0.5, 4), (1.0, 2), (2.0, 2), (10.0, 2)])
def test_a_worker_with_a_slower_heartbeat_has_more_time(heartbeat, pings):
    detector = FailureDetector(heartbeat, TIMEOUTS)
    for _ in range(pings):
        detector.asked()
    assert detector.suspicion is None
    detector.asked()
    assert detector.suspicion is Suspicion.SILENT


def test_a_worker_is_stuck_when_its_counter_stands_still_while_it_holds_calls():
    detector = FailureDetector(0.5, TIMEOUTS)
    beat(detector, 7)
    assert detector.suspicion is None
    beat(detector, 1)
    assert detector.suspicion is Suspicion.STUCK


def test_a_slow_worker_is_not_stuck():
    detector = FailureDetector(0.5, TIMEOUTS)
    for progress in range(10):
        beat(detector, 6, progress=progress)
    assert detector.suspicion is None


def test_a_worker_that_answers_and_does_not_count_is_not_stuck():
    detector = FailureDetector(0.5, TIMEOUTS)
    for _ in range(10):
        beat(detector, 5)
        detector.moved()
    assert detector.suspicion is None


def test_a_worker_that_holds_nothing_is_not_stuck():
    detector = FailureDetector(0.5, TIMEOUTS)
    beat(detector, 100, holds_calls=False)
    beat(detector, 6)
    assert detector.suspicion is None


def test_a_worker_whose_calls_are_given_up_one_after_the_other_is_stuck_all_the_same():
    detector = FailureDetector(0.5, TIMEOUTS)
    beat(detector, 1)
    for _ in range(3):
        beat(detector, 2)
        beat(detector, 10, holds_calls=False)
    assert detector.suspicion is Suspicion.STUCK


def test_pongs_that_come_all_at_once_count_as_one():
    detector = FailureDetector(0.5, TIMEOUTS)
    beat(detector, 1)
    for _ in range(100):
        detector.answered(pong(), holds_calls=True)
    beat(detector, 1)
    assert detector.suspicion is None


def test_a_stuck_worker_stays_so_when_nobody_waits_for_it_any_more_until_it_gets_on():
    detector = FailureDetector(0.5, TIMEOUTS)
    beat(detector, 8)
    beat(detector, 10, holds_calls=False)
    assert detector.suspicion is Suspicion.STUCK
    beat(detector, 1, progress=1, holds_calls=False)
    assert detector.suspicion is None
