"""A worker gets calls while it answers pings, says that it is at work, and answers calls."""

import pytest

from protocol.client.failure_detector import Suspicion
from protocol.client.worker_health import WorkerHealth
from protocol.messages import Pong, Role, State
from protocol.timeouts import Timeouts

TIMEOUTS = Timeouts(heartbeat=0.5, liveness=1.0, progress=1.0)


def pong(state: State = State.READY, **fields) -> Pong:
    return Pong(incarnation="x", state=state, progress=0, queue_depth=0, resident_bytes=0, **fields)


@pytest.fixture
def health() -> WorkerHealth:
    return WorkerHealth("render at ipc:///render-0", TIMEOUTS, lambda: 7.0)


def leave_unanswered(health: WorkerHealth, pings: int) -> None:
    for _ in range(pings):
        health.pinged()


def test_nothing_is_known_before_the_first_pong(health):
    assert not health.is_at_work
    assert health.needs_pings
    assert (health.heard, health.lacks) == (None, ())


@pytest.mark.parametrize(
    ("state", "at_work", "needs_pings"),
    [
        (State.STARTING, False, True),
        (State.READY, True, False),
        (State.BUSY, True, False),
        (State.DRAINING, False, False),
    ],
)
def test_a_pong_says_whether_the_worker_is_at_work(health, state, at_work, needs_pings):
    health.hear()
    health.answered_ping(pong(state, lacks=(Role.RENDER,)), holds_calls=False)
    assert (health.is_at_work, health.needs_pings) == (at_work, needs_pings)
    assert (health.heard, health.lacks) == (7.0, (Role.RENDER,))


def test_a_worker_that_answers_no_pings_gets_no_calls_until_it_is_heard_again(health, caplog):
    caplog.set_level("INFO")
    health.answered_ping(pong(), holds_calls=False)
    leave_unanswered(health, 3)
    assert (health.suspicion, health.is_at_work, health.needs_pings) == (Suspicion.SILENT, False, True)
    health.hear()
    assert health.is_at_work
    assert [record.getMessage() for record in caplog.records] == [
        "render at ipc:///render-0 gets no more calls: it answers no pings",
        "render at ipc:///render-0 gets calls again",
    ]


def test_a_worker_that_starts_may_be_silent(health):
    health.answered_ping(pong(State.STARTING), holds_calls=False)
    leave_unanswered(health, 100)
    assert health.suspicion is None


def test_the_agreed_interval_says_how_many_pings_may_stay_unanswered(health):
    health.expect_pings_every(0.1)
    health.answered_ping(pong(), holds_calls=False)
    leave_unanswered(health, 10)
    assert health.suspicion is None
    leave_unanswered(health, 1)
    assert health.suspicion is Suspicion.SILENT


def test_a_worker_that_refuses_work_as_it_drains_is_not_at_work(health):
    health.refused_as_draining()
    assert health.pong is None
    health.answered_ping(pong(State.BUSY), holds_calls=True)
    health.refused_as_draining()
    assert (health.is_at_work, health.needs_pings) == (False, False)
