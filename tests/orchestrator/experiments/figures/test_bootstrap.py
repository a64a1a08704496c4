import numpy as np
import pytest

from orchestrator.experiments.figures.bootstrap import figure, mean, people_of, quantile, samples_of_people
from protocol.errors import InvalidInput


def test_people_are_numbered_from_nought():
    assert list(people_of(np.array([44, 40, 44, 59]))) == [1, 0, 1, 2]


def test_the_first_sample_has_everybody_once_and_the_others_as_many_people():
    samples = samples_of_people(20)
    assert samples.shape == (1001, 20)
    assert set(samples[0]) == {1}
    assert set(samples.sum(axis=1)) == {20}
    assert (samples == samples_of_people(20)).all()
    assert (samples[1:] == 0).any()


def test_figures_of_nobody_are_refused():
    with pytest.raises(InvalidInput):
        samples_of_people(0)


def test_a_mean_over_resampled_people():
    # Person 0 has 1 and 3, person 1 has 8.
    person, values = np.array([0, 0, 1]), np.array([1.0, 3.0, 8.0])
    samples = np.array([[1, 1], [2, 0], [0, 2], [0, 0]])
    assert mean(values, person, samples) == pytest.approx([4.0, 2.0, 8.0, np.nan], nan_ok=True)


def test_a_quantile_over_resampled_people():
    person, values = np.array([0, 1, 0, 1]), np.array([4.0, 1.0, 2.0, 3.0])
    samples = np.array([[1, 1], [2, 0], [0, 1], [1, 3]])
    # Everybody: 1 2 3 4; twice person 0: 2 2 4 4; person 1: 1 3; once 0 and thrice 1: 1 1 1 2 3 3 3 4.
    assert list(quantile(values, 0.5, person, samples)) == [2.0, 2.0, 1.0, 2.0]
    assert list(quantile(values, 0.9, person, samples)) == [4.0, 4.0, 3.0, 4.0]
    assert np.isnan(quantile(np.array([]), 0.5, np.array([], int), samples)).all()
    assert np.isnan(quantile(values[:1], 0.5, person[:1], np.array([[0, 2]]))).all()


def test_an_interval_has_95_of_100_samples_in_it():
    found = figure(np.concatenate([[50.0], np.arange(101.0)]))
    assert (found.value, found.low, found.high) == pytest.approx((50.0, 2.5, 97.5))


def test_samples_without_a_figure_do_not_count_for_the_interval():
    found = figure(np.array([1.0, np.nan, 1.0, 1.0]))
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)
    assert np.isnan(figure(np.array([np.nan, 1.0])).low)
    assert np.isnan(figure(np.array([1.0, np.nan])).low)


def test_the_interval_of_a_mean_is_as_wide_as_people_differ():
    random = np.random.default_rng(0)
    person = np.repeat(np.arange(25), 40)
    values = np.repeat(random.normal(size=25), 40) + 0.01 * random.normal(size=1000)
    found = figure(mean(values, person, samples_of_people(25)))
    # Of 25 independent values of deviation 1; as of 1000 it would be a sixth of that.
    assert found.high - found.low == pytest.approx(2 * 1.96 / 5, rel=0.3)
