"""How well an uncertainty predicts an error: correlations and the area under the ROC curve, in many samples of people.

Every function takes (n,) values, the (n,) person that each is of, and samples as of `bootstrap.samples_of_people`, and
gives a value for each sample: NaN where it is not defined. All of them are exact, ranks included: a rank in a sample is
a sum of ranks among each person's values.
"""

import numpy as np

from orchestrator.experiments.figures.bootstrap import IntArray
from protocol.arrays import BoolArray, Float64Array


def pearson(x: Float64Array, y: Float64Array, person: IntArray, samples: IntArray) -> Float64Array:
    """Pearson's correlation of x and y."""
    if len(x) == 0:
        return np.full(len(samples), np.nan)
    people = samples.shape[1]
    # Centred by the whole sample, or squares of large values would drown what differs.
    x, y = x - float(np.mean(x)), y - float(np.mean(y))
    parts = (np.ones_like(x), x, y, x * x, y * y, x * y)
    sums = samples @ np.stack([np.bincount(person, part, people) for part in parts], axis=1)
    return _correlation(*sums.T)


def spearman(x: Float64Array, y: Float64Array, person: IntArray, samples: IntArray) -> Float64Array:
    """Spearman's rank correlation; values that are the same share their mean rank."""
    if len(x) == 0:
        return np.full(len(samples), np.nan)
    people = samples.shape[1]
    ranks_x, ranks_y = _ranks_among(x, x, person, people), _ranks_among(y, y, person, people)
    count = (samples @ np.bincount(person, minlength=people)).astype(float)
    sums = (_linear(ranks_x, person, samples), _linear(ranks_y, person, samples))
    squares = (
        _quadratic(first, second, person, samples)
        for first, second in ((ranks_x, ranks_x), (ranks_y, ranks_y), (ranks_x, ranks_y))
    )
    return _correlation(count, *sums, *squares)


def auroc(score: Float64Array, positive: BoolArray, person: IntArray, samples: IntArray) -> Float64Array:
    """The probability that a positive has a higher score than a negative; ties count half."""
    people = samples.shape[1]
    wins = np.zeros((people, people))
    above = _ranks_among(score[positive], score[~positive], person[~positive], people)
    np.add.at(wins, person[positive], above)
    pairs = (samples @ np.bincount(person[positive], minlength=people)) * (
        samples @ np.bincount(person[~positive], minlength=people)
    )
    return np.where(pairs > 0, _paired(wins, samples) / np.maximum(pairs, 1), np.nan)


def _ranks_among(values: Float64Array, others: Float64Array, person: IntArray, people: int) -> Float64Array:
    """(n, people) how many of each person's `others` are below each value, those that are the same by half."""
    levels, level = np.unique(np.concatenate([values, others]), return_inverse=True)
    own, theirs = level[: len(values)], level[len(values) :]
    count = np.bincount(theirs * people + person, minlength=len(levels) * people).reshape(-1, people)
    return (np.cumsum(count, axis=0) - count / 2)[own]


def _linear(ranks: Float64Array, person: IntArray, samples: IntArray) -> Float64Array:
    """In each sample, the sum of the ranks."""
    return _paired(np.stack([ranks[rows].sum(axis=0) for rows in _rows(person, samples.shape[1])]), samples)


def _quadratic(first: Float64Array, second: Float64Array, person: IntArray, samples: IntArray) -> Float64Array:
    """In each sample, the sum of the products of two ranks."""
    people = samples.shape[1]
    products = np.stack([first[rows].T @ second[rows] for rows in _rows(person, people)])
    weights = samples.astype(float)
    in_sample = (weights @ products.reshape(people, -1)).reshape(-1, people, people)
    return (np.matmul(in_sample, weights[:, :, None])[:, :, 0] * weights).sum(axis=1)


def _paired(sums: Float64Array, samples: IntArray) -> Float64Array:
    """In each sample, the sum over pairs of people in it."""
    weights = samples.astype(float)
    return ((weights @ sums) * weights).sum(axis=1)


def _rows(person: IntArray, people: int) -> list[IntArray]:
    return [np.flatnonzero(person == number) for number in range(people)]


def _correlation(
    count: Float64Array, x: Float64Array, y: Float64Array, xx: Float64Array, yy: Float64Array, xy: Float64Array
) -> Float64Array:
    """Of sums: of ones, x, y, and their products."""
    varied = (count * xx - x * x) * (count * yy - y * y)
    # What is left of two equal sums by rounding is no variance.
    defined = varied > 1e-18 * (count * xx) * (count * yy)
    return np.where(defined, (count * xy - x * y) / np.sqrt(np.where(defined, varied, 1.0)), np.nan)
