import pytest

from orchestrator.chaos.step_limit import StepLimit


@pytest.fixture
def limit(rehearsed):
    return StepLimit(rehearsed.failpoints)


def test_a_training_goes_by_every_step_that_is_not_the_limit(rehearsed, limit):
    limit.move(8)
    rehearsed.failpoints.reach("step-4")
    assert not limit.is_reached


def test_a_training_that_waits_at_the_limit_has_reached_it_and_goes_on_when_it_is_moved(limit, fly, wait_until):
    limit.move(8)
    training = fly(16)
    wait_until(lambda: limit.is_reached)
    assert training.flown == 8
    limit.move(12)
    wait_until(lambda: limit.is_reached)
    assert training.flown == 12
    limit.lift()
    training.join()
    assert training.flown == 16


def test_a_limit_that_is_moved_is_not_reached_by_a_training_at_the_one_before(rehearsed, limit, fly, wait_until):
    limit.move(8)
    fly(16)
    wait_until(lambda: limit.is_reached)
    limit.move(20)
    assert not limit.is_reached
    assert not rehearsed.failpoints.is_pending("step-8")


def test_a_limit_that_stays_where_it_is_stays_reached(limit, fly, wait_until):
    limit.move(8)
    training = fly(16)
    wait_until(lambda: limit.is_reached)
    limit.move(8)
    assert limit.is_reached
    limit.lift()
    training.join()


def test_a_training_that_was_set_back_waits_at_the_limit_again(limit, fly, wait_until):
    limit.move(8)
    fly(16)
    wait_until(lambda: limit.is_reached)
    again = fly(16)
    wait_until(lambda: again.flown == 8)
    again.join(0.1)
    assert again.flown == 8


def test_without_a_limit_none_is_reached(limit, fly):
    limit.lift()
    assert not limit.is_reached
    fly(16).join()
    assert not limit.is_reached
