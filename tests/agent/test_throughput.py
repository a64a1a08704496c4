import itertools

import pytest

from agent.throughput import Pace


def test_the_pace_is_zero_before_the_first_step() -> None:
    assert Pace(lambda: 5.0).steps_per_second == 0.0


def test_the_pace_is_that_of_the_last_seconds() -> None:
    # One reading of the clock a second; four steps a second for a minute, then forty.
    pace = Pace(itertools.count(0.0, 1.0).__next__)
    done = 0
    for _ in range(60):
        done += 4
        pace.reached(done)
    assert pace.steps_per_second == pytest.approx(4.0)
    for _ in range(20):
        done += 40
        pace.reached(done)
    assert pace.steps_per_second == pytest.approx(40.0)


def test_steps_that_an_earlier_process_has_done_are_no_pace() -> None:
    pace = Pace(itertools.count(0.0, 1.0).__next__, done=1000)
    assert pace.steps_per_second == 0.0
    pace.reached(1004)
    assert pace.steps_per_second == pytest.approx(4.0)
