"""Hand-worked cases, and samples of people written out frame by frame for other libraries' formulas."""

import numpy as np
import pytest
from scipy import stats

from orchestrator.experiments.figures.correlation import auroc, pearson, spearman

ONE = np.array([[1]])
SAMPLES = np.array([[1, 1, 1], [3, 0, 0], [0, 2, 1], [1, 2, 0]])


def one_person(values):
    return np.zeros(len(values), int)


def test_pearson_by_hand():
    # Deviations (-1, 0, 1) and (-1, -1, 2): covariance 3, variances 2 and 6.
    found = pearson(np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0, 4.0]), one_person("abc"), ONE)
    assert found == pytest.approx([3 / np.sqrt(12)])


def test_pearson_of_a_line_is_one_and_of_a_falling_one_minus_one():
    x = np.array([1e6, 1e6 + 1, 1e6 + 2])
    assert pearson(x, 5 - 2 * x, one_person(x), ONE) == pytest.approx([-1.0])
    assert pearson(x, 7 * x, one_person(x), ONE) == pytest.approx([1.0])


def test_spearman_by_hand():
    # Ranks 1 2 3 4 and 2 1 4 3: one less 6 times the sum of squared differences, 4, over 4 * 15.
    x, y = np.array([1.0, 2.0, 30.0, 400.0]), np.array([0.2, 0.1, 9.0, 0.3])
    assert spearman(x, y, one_person(x), ONE) == pytest.approx([1 - 6 * 4 / 60])


def test_spearman_shares_ranks_among_equals():
    # Ranks 1.5 1.5 3 and 1 2 3: deviations (-.5, -.5, 1) and (-1, 0, 1), covariance 1.5, variances 1.5 and 2.
    x, y = np.array([5.0, 5.0, 6.0]), np.array([1.0, 2.0, 3.0])
    assert spearman(x, y, one_person(x), ONE) == pytest.approx([1.5 / np.sqrt(3)])


def test_auroc_by_hand():
    # Positives 3 and 1, negatives 1, 2 and 0: 3 wins thrice, 1 wins once and draws once; 4.5 of 6.
    score, positive = np.array([3.0, 1.0, 1.0, 2.0, 0.0]), np.array([True, True, False, False, False])
    assert auroc(score, positive, one_person(score), ONE) == pytest.approx([4.5 / 6])


def test_what_does_not_vary_has_no_correlation():
    constant, rising = np.full(5, 0.1), np.arange(5.0)
    assert np.isnan(pearson(constant, rising, one_person(rising), ONE)).all()
    assert np.isnan(spearman(rising, constant, one_person(rising), ONE)).all()
    assert np.isnan(auroc(rising, rising >= 0, one_person(rising), ONE)).all()


def test_nothing_has_no_correlation():
    nothing = np.array([])
    for correlation in (pearson, spearman):
        assert np.isnan(correlation(nothing, nothing, nothing.astype(int), ONE)).all()
    assert np.isnan(auroc(nothing, nothing.astype(bool), nothing.astype(int), ONE)).all()


@pytest.fixture
def values():
    random = np.random.default_rng(1)
    person = random.integers(3, size=120)
    x = np.round(random.gamma(1.0, size=120), 1)  # with ties
    return x, np.round(x + random.gamma(2.0, size=120) + person, 1), person


def written_out(sample, *columns, person):
    rows = np.concatenate([np.flatnonzero(person == number) for number in range(3) for _ in range(sample[number])])
    return [column[rows] for column in columns]


def test_every_sample_of_people_has_the_correlation_of_its_values_written_out(values):
    x, y, person = values
    for one, found in zip(SAMPLES, pearson(x, y, person, SAMPLES), strict=True):
        assert found == pytest.approx(stats.pearsonr(*written_out(one, x, y, person=person)).statistic)
    for one, found in zip(SAMPLES, spearman(x, y, person, SAMPLES), strict=True):
        assert found == pytest.approx(stats.spearmanr(*written_out(one, x, y, person=person)).statistic)


def test_every_sample_of_people_has_the_auroc_of_its_values_written_out(values):
    x, y, person = values
    for one, found in zip(SAMPLES, auroc(x, y > 2.0, person, SAMPLES), strict=True):
        score, positive = written_out(one, x, y > 2.0, person=person)
        wins = stats.mannwhitneyu(score[positive], score[~positive]).statistic
        assert found == pytest.approx(wins / (positive.sum() * (~positive).sum()))
