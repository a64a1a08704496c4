import itertools

import pytest

from agent.throughput import Throughput


def test_the_pace_is_zero_before_the_first_step() -> None:
    assert Throughput(lambda: 5.0).steps_per_second == 0.0


def test_the_pace_is_that_of_the_last_seconds() -> None:
    # One reading of the clock a second; four steps a second for a minute, then forty.
    throughput = Throughput(itertools.count(0.0, 1.0).__next__)
    done = 0
    for _ in range(60):
        done += 4
        throughput.reached(done)
    assert throughput.steps_per_second == pytest.approx(4.0)
    for _ in range(20):
        done += 40
        throughput.reached(done)
    assert throughput.steps_per_second == pytest.approx(40.0)


def test_steps_that_an_earlier_process_has_done_are_no_pace() -> None:
    throughput = Throughput(itertools.count(0.0, 1.0).__next__, done=1000)
    assert throughput.steps_per_second == 0.0
    throughput.reached(1004)
    assert throughput.steps_per_second == pytest.approx(4.0)
