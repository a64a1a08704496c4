from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.chaos.catalogue import catalogue
from orchestrator.chaos.schedule import plan, strike_times

NAMES = st.lists(st.text("abc-", min_size=1, max_size=6), min_size=1, max_size=20, unique=True)
SEEDS = st.integers(0, 2**31)


@given(SEEDS, st.integers(1, 60), NAMES, st.integers(200, 10**6))
def test_a_schedule_follows_from_its_arguments_alone(seed, faults, names, steps):
    assert plan(seed, faults, names, steps) == plan(seed, faults, names, steps)


@given(SEEDS, st.integers(1, 60), NAMES, st.integers(200, 10**6))
def test_every_class_has_its_turn_before_any_has_another(seed, faults, names, steps):
    counts = Counter(fault.scenario for fault in plan(seed, faults, names, steps))
    assert counts.total() == faults
    assert set(counts) <= set(names)
    assert all(faults // len(names) <= counts[name] <= -(-faults // len(names)) for name in names)


@given(SEEDS, st.integers(1, 60), NAMES, st.integers(200, 10**6))
def test_faults_come_in_order_and_are_spread_over_the_run(seed, faults, names, steps):
    moments = [fault.step for fault in plan(seed, faults, names, steps)]
    assert moments == sorted(moments)
    assert moments[0] > 0
    assert moments[-1] < 0.9 * steps
    stretch = 0.87 * steps / faults
    assert all(
        abs(moment - (0.03 * steps + (index + 0.5) * stretch)) <= 0.5 * stretch + 1
        for index, moment in enumerate(moments)
    )


def test_another_seed_is_another_schedule():
    names = tuple(catalogue())
    assert plan(7, 20, names, 3400) != plan(8, 20, names, 3400)


@given(SEEDS)
def test_twenty_faults_are_enough_for_every_class_that_there_is(seed):
    assert {fault.scenario for fault in plan(seed, 20, tuple(catalogue()), 3400)} == set(catalogue())


@given(SEEDS, st.floats(0.5, 100), st.floats(0, 5000))
def test_moments_at_a_rate_lie_in_order_within_the_time_that_was_given(seed, mean, seconds):
    moments = strike_times(seed, mean, seconds)
    assert list(moments) == sorted(moments)
    assert all(0 < moment < seconds for moment in moments)


def test_moments_at_a_rate_keep_to_it():
    assert len(strike_times(3, mean=20.0, seconds=200_000.0)) == pytest.approx(10_000, rel=0.05)
