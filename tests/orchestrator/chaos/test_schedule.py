from collections import Counter
from math import ceil

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from orchestrator.chaos.scenarios.catalogue import catalogue
from orchestrator.chaos.schedule import plan, steps_to_a_checkpoint, strike_times
from protocol.errors import InvalidInput

NAMES = st.lists(st.text("abc-", min_size=1, max_size=6), min_size=1, max_size=20, unique=True)
SEEDS = st.integers(0, 2**31)


@st.composite
def runs(draw):
    """Faults, steps and drones of a run that has room for so many faults."""
    faults, drones = draw(st.integers(1, 60)), draw(st.integers(1, 16))
    fewest = ceil(faults * 20 / 0.87) + 1
    return faults, drones * draw(st.integers(fewest, 10**5)), drones


@given(SEEDS, runs(), NAMES)
def test_a_schedule_follows_from_its_arguments_alone(seed, run, names):
    faults, steps, drones = run
    assert plan(seed, faults, names, steps, drones=drones) == plan(seed, faults, names, steps, drones=drones)


@given(SEEDS, runs(), NAMES)
def test_every_class_has_its_turn_before_any_has_another(seed, run, names):
    faults, steps, drones = run
    counts = Counter(fault.scenario for fault in plan(seed, faults, names, steps, drones=drones))
    assert counts.total() == faults
    assert set(counts) <= set(names)
    assert all(faults // len(names) <= counts[name] <= -(-faults // len(names)) for name in names)


@given(SEEDS, runs(), NAMES)
def test_each_fault_has_a_stretch_of_the_run_to_itself_and_the_last_one_ends_before_the_run(seed, run, names):
    faults, steps, drones = run
    schedule = plan(seed, faults, names, steps, drones=drones)
    ends = [0.03 * steps, *(fault.recovery_until for fault in schedule)]
    assert all(end <= fault.step < fault.recovery_until for end, fault in zip(ends, schedule, strict=False))
    assert ends[-1] <= 0.9 * steps
    stretch = 0.87 * steps / faults
    assert all(
        abs(fault.step - (0.03 * steps + number * stretch)) <= 0.25 * stretch + drones
        for number, fault in enumerate(schedule)
    )


@given(SEEDS, runs(), NAMES)
def test_a_training_comes_to_every_step_at_which_it_is_to_wait(seed, run, names):
    faults, steps, drones = run
    for fault in plan(seed, faults, names, steps, drones=drones):
        assert fault.step % drones == fault.fault_until % drones == fault.recovery_until % drones == 0


@given(SEEDS, runs(), NAMES)
def test_a_checkpoint_is_due_while_a_fault_happens_and_there_are_steps_left_for_the_recovery(seed, run, names):
    faults, steps, drones = run
    every = steps_to_a_checkpoint(faults, steps)
    for fault in plan(seed, faults, names, steps, drones=drones):
        due = (fault.step // every + 1) * every
        assert fault.step < due <= fault.fault_until
        assert ceil(due / drones) * drones <= fault.fault_until
        # What was reached is known to within a step of all drones, and recovery is beyond that.
        assert fault.recovery_until > fault.fault_until + drones


@given(SEEDS, st.integers(1, 500), st.integers(1, 20_000), st.integers(1, 16))
def test_faults_that_a_run_has_no_room_for_are_refused(seed, faults, steps, drones):
    assume(faults * 20 * drones > 0.87 * steps)
    with pytest.raises(InvalidInput, match=f"a training of {steps} steps, .* not for {faults}; ask for fewer"):
        plan(seed, faults, ("kill-agent",), steps, drones=drones)


def test_a_refusal_tells_how_many_faults_are_possible():
    with pytest.raises(InvalidInput, match="at most 36 faults, not for 37"):
        plan(7, 37, ("kill-agent",), 3400, drones=4)
    assert len(plan(7, 36, ("kill-agent",), 3400, drones=4)) == 36


def test_another_seed_is_another_schedule():
    names = tuple(catalogue())
    assert plan(7, 20, names, 3400, drones=4) != plan(8, 20, names, 3400, drones=4)


@given(SEEDS)
def test_twenty_faults_are_enough_for_every_class_that_there_is(seed):
    names = tuple(catalogue())
    assert {fault.scenario for fault in plan(seed, 20, names, 3400, drones=4)} == set(names)


@given(SEEDS, st.floats(0.5, 100), st.floats(0, 5000))
def test_moments_at_a_rate_lie_in_order_within_the_time_that_was_given(seed, mean, seconds):
    moments = strike_times(seed, mean, seconds)
    assert list(moments) == sorted(moments)
    assert all(0 < moment < seconds for moment in moments)


def test_moments_at_a_rate_keep_to_it():
    assert len(strike_times(3, mean=20.0, seconds=200_000.0)) == pytest.approx(10_000, rel=0.05)
