import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.kalman import REPEATED, update
from protocol.joint_arrays import FARTHEST, MOST_VARIANCE
from protocol.pose_estimate import FilterState
from protocol.skeleton import Joint

NOTHING = np.full((18, 3), np.nan)


def seen(joint, position):
    points = NOTHING.copy()
    points[joint] = position
    return points


def uniform(quality):
    return np.full(18, quality)


class DenseFilter:
    """The textbook's filter with 54×54 matrices, and the thesis's schedule for Q and R."""

    def __init__(self):
        self.x, self.p = np.zeros(54), np.eye(54)
        self.q, self.ever = np.full(54, 0.01), np.zeros(54, bool)

    def step(self, points, quality):
        measured = np.isfinite(points.ravel())
        self.p = self.p + np.diag(np.where(self.ever, self.q, 0.0))
        h = np.eye(54)[measured]
        r = np.diag(np.repeat(np.maximum(1 - quality, 1e-4), 3)[measured])
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        self.x = self.x + gain @ (points.ravel()[measured] - h @ self.x)
        self.p = (np.eye(54) - gain @ h) @ self.p
        self.q[~measured & self.ever] += 0.001
        self.q[measured] = 0.01
        self.ever |= measured


def test_the_first_observation_weighs_against_a_variance_of_one():
    # Quality 0.5 is a noise of 0.5 m²: gain 1 / 1.5, posterior 0.5 / 1.5.
    state = update(FilterState.initial(), seen(Joint.NOSE, (3.0, 0.0, 1.5)), uniform(0.5))
    assert state.mean[Joint.NOSE] == pytest.approx([2.0, 0.0, 1.0])
    assert state.variance[Joint.NOSE] == pytest.approx(np.full(3, 1 / 3))
    assert state.seen.sum() == 1


def test_the_second_observation_adds_process_noise_first():
    first = update(FilterState.initial(), seen(Joint.NOSE, (0, 0, 0)), uniform(0.5))
    second = update(first, seen(Joint.NOSE, (0, 0, 0)), uniform(0.5))
    predicted = 1 / 3 + 0.01
    assert second.variance[Joint.NOSE] == pytest.approx(np.full(3, predicted * 0.5 / (predicted + 0.5)))


def test_an_unseen_joint_grows_less_sure_by_ever_more():
    state = update(FilterState.initial(), seen(Joint.NECK, (1, 2, 3)), uniform(0.5))
    start = state.variance[Joint.NECK, 0]
    grown = []
    for _ in range(3):
        state = update(state, NOTHING, uniform(0.0))
        grown.append(state.variance[Joint.NECK, 0] - start)
    assert grown == pytest.approx([0.010, 0.010 + 0.011, 0.010 + 0.011 + 0.012])
    assert state.process_noise[Joint.NECK] == pytest.approx(0.013)
    assert state.mean[Joint.NECK] == pytest.approx([2 / 3, 4 / 3, 2])


def test_a_joint_seen_again_is_back_at_the_base_of_process_noise():
    state = update(FilterState.initial(), seen(Joint.NECK, (1, 2, 3)), uniform(0.5))
    state = update(state, NOTHING, uniform(0.0))
    state = update(state, seen(Joint.NECK, (1, 2, 3)), uniform(0.5))
    assert state.process_noise[Joint.NECK] == 0.01


def test_a_joint_never_seen_stays_as_it_was():
    state = FilterState.initial(mean=(1.0, 2.0, 1.4))
    for _ in range(5):
        state = update(state, seen(Joint.NOSE, (0, 0, 0)), uniform(0.9))
    assert (state.variance[Joint.NECK] == 1.0).all()
    assert state.process_noise[Joint.NECK] == 0.01
    assert (state.mean[Joint.NECK] == (1.0, 2.0, 1.4)).all()
    assert not state.seen[Joint.NECK]


def test_full_quality_is_not_full_trust():
    state = update(FilterState.initial(), seen(Joint.NOSE, (1, 1, 1)), uniform(1.0))
    assert state.variance[Joint.NOSE] == pytest.approx(np.full(3, 1e-4 / 1.0001))


def test_the_better_seen_joint_pulls_harder():
    points = seen(Joint.NOSE, (1, 1, 1))
    points[Joint.NECK] = 1, 1, 1
    quality = uniform(0.9)
    quality[Joint.NECK] = 0.2
    state = update(FilterState.initial(), points, quality)
    assert (state.mean[Joint.NOSE] > state.mean[Joint.NECK]).all()


def test_the_state_that_came_in_is_left_as_it_was():
    before = FilterState.initial()
    update(before, seen(Joint.NOSE, (1, 1, 1)), uniform(0.5))
    assert not before.mean.any()
    assert (before.variance == 1.0).all()
    assert not before.seen.any()


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_equals_the_dense_filter(seed, steps):
    rng = np.random.default_rng(seed)
    state, dense = FilterState.initial(), DenseFilter()
    for _ in range(steps):
        points = rng.normal(size=(18, 3))
        points[rng.random(18) < 0.5] = np.nan
        quality = rng.choice([0.0, 1.0, rng.random()], 18)
        state = update(state, points, quality)
        dense.step(points, quality)
    assert state.mean.ravel() == pytest.approx(dense.x, abs=1e-9)
    assert np.diag(state.variance.ravel()) == pytest.approx(dense.p, abs=1e-9)
    assert np.repeat(state.process_noise, 3) == pytest.approx(dense.q)
    assert (np.repeat(state.seen, 3) == dense.ever).all()


class TestByVariance:
    """A filter whose noise is what a lifter says of itself."""

    def test_a_new_joint_is_as_sure_as_its_observation_made_larger(self):
        variance = np.full((18, 3), 0.0025)
        state = update(FilterState.initial(rule="variance"), seen(Joint.NOSE, (1, 2, 3)), uniform(0.0), variance)
        noise = REPEATED * 0.0025
        assert state.variance[Joint.NOSE] == pytest.approx(np.full(3, noise / (1 + noise)))
        assert state.mean[Joint.NOSE] == pytest.approx(np.array([1, 2, 3]) / (1 + noise))
        assert state.rule == "variance"

    def test_each_axis_has_a_noise_of_its_own(self):
        variance = np.tile([0.0004, 0.01, 0.09], (18, 1))
        state = update(FilterState.initial(rule="variance"), seen(Joint.NECK, (0, 0, 0)), uniform(1.0), variance)
        assert np.all(np.diff(state.variance[Joint.NECK]) > 0)

    def test_quality_says_nothing(self):
        variance = np.full((18, 3), 0.01)
        good, bad = (
            update(FilterState.initial(rule="variance"), seen(Joint.NECK, (0, 1, 0)), uniform(quality), variance)
            for quality in (1.0, 0.0)
        )
        np.testing.assert_array_equal(good.variance, bad.variance)

    def test_a_joint_that_is_not_located_grows_less_sure(self):
        state = update(
            FilterState.initial(rule="variance"), seen(Joint.NECK, (0, 1, 0)), uniform(0.0), np.full((18, 3), 0.01)
        )
        later = update(state, NOTHING, uniform(0.0), np.full((18, 3), np.nan))
        assert later.variance[Joint.NECK, 0] == state.variance[Joint.NECK, 0] + state.process_noise[Joint.NECK]
        assert later.process_noise[Joint.NECK] > state.process_noise[Joint.NECK]
        assert np.isfinite(later.mean).all()

    def test_where_no_lifter_tells_a_variance_quality_does(self):
        by_variance = update(FilterState.initial(rule="variance"), seen(Joint.NECK, (0, 1, 0)), uniform(0.5))
        by_quality = update(FilterState.initial(), seen(Joint.NECK, (0, 1, 0)), uniform(0.5))
        np.testing.assert_array_equal(by_variance.variance, by_quality.variance)


@pytest.mark.parametrize("rule", ["quality", "variance"])
def test_a_filter_at_its_bounds_goes_on_to_one_that_can_travel(rule):
    widest = FilterState(
        mean=np.full((18, 3), FARTHEST),
        variance=np.full((18, 3), MOST_VARIANCE),
        process_noise=np.full(18, MOST_VARIANCE),
        seen=np.ones(18, bool),
        rule=rule,
    )
    unseen = update(widest, NOTHING, uniform(0.0))
    assert unseen.variance.max() == unseen.process_noise.max() == MOST_VARIANCE
    found = update(unseen, seen(Joint.NOSE, (-FARTHEST, 0.0, 1.5)), uniform(0.5), np.full((18, 3), 0.01))
    assert found.variance[Joint.NOSE].max() < 1.0
