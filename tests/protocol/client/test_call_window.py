"""A worker gets any number of calls until it is overloaded, and then as many as it takes."""

import math

from protocol.client.call_window import CallWindow


def test_it_is_unbounded_until_the_worker_is_overloaded():
    window = CallWindow()
    window.grow()
    assert window.size == math.inf


def test_an_overload_closes_it_to_what_the_worker_holds_but_never_altogether():
    window = CallWindow()
    window.shrink(3)
    assert window.size == 3
    window.shrink(0)
    assert window.size == 1


def test_it_grows_by_one_each_time_all_of_it_was_answered():
    window = CallWindow()
    window.shrink(4)
    for _ in range(4):
        window.grow()
    assert 4.8 < window.size <= 5
