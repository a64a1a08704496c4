import numpy as np
import pytest

from agent.intervals import mean_interval, rate_interval


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # Wilson's interval, from the closed formula with z = 1.96; the first is the usual textbook example.
    [(5, 10, 0.2366, 0.7634), (0, 20, 0.0, 0.1611), (20, 20, 0.8389, 1.0), (1, 50, 0.0035, 0.1050)],
)
def test_wilsons_interval(successes, trials, low, high) -> None:
    interval = rate_interval(successes, trials)
    assert interval.mean == successes / trials
    assert (interval.low, interval.high) == (pytest.approx(low, abs=2e-4), pytest.approx(high, abs=2e-4))


def test_the_interval_of_equal_values_is_a_point() -> None:
    interval = mean_interval([3.0, 3.0, 3.0])
    assert (interval.mean, interval.low, interval.high) == (3.0, 3.0, 3.0)


def test_the_interval_of_a_mean_is_as_wide_as_theory_has_it() -> None:
    values = np.random.default_rng(0).normal(10.0, 2.0, 400)
    interval = mean_interval(values.tolist())
    half = 1.96 * values.std() / np.sqrt(400)
    assert interval.mean == pytest.approx(values.mean())
    assert interval.low == pytest.approx(values.mean() - half, abs=0.03)
    assert interval.high == pytest.approx(values.mean() + half, abs=0.03)


def test_the_same_values_have_the_same_interval() -> None:
    assert mean_interval([1.0, 2.0, 5.0]) == mean_interval([1.0, 2.0, 5.0])
