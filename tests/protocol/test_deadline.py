"""Inner calls never outlive the outer one."""

import threading

from protocol.deadline import deadline, remaining


def test_without_a_deadline_nothing_is_bounded():
    assert remaining(5.0) == 5.0


def test_the_sooner_one_counts():
    with deadline(100.0):
        assert remaining(5.0) == 5.0
        assert 90.0 < remaining(1000.0) <= 100.0


def test_a_deadline_that_has_passed_leaves_less_than_nothing():
    with deadline(-1.0):
        assert remaining(5.0) < 0


def test_the_outer_deadline_is_back_after_the_inner_one():
    with deadline(100.0):
        with deadline(1.0):
            assert remaining(1000.0) <= 1.0
            with deadline(50.0):
                assert remaining(1000.0) <= 1.0
        assert remaining(1000.0) > 90.0
    assert remaining(1000.0) == 1000.0


def test_another_thread_has_its_own():
    seen = []
    with deadline(1.0):
        thread = threading.Thread(target=lambda: seen.append(remaining(1000.0)))
        thread.start()
        thread.join()
    assert seen == [1000.0]
