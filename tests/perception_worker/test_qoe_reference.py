"""Quality of estimation against the slow, plain one: whole frames, drawn at random."""

from itertools import pairwise

import numpy as np
import pytest

from perception_worker.qoe import quality_of_estimation
from tests.perception_worker import reference_qoe
from tests.perception_worker.test_qoe import CHAIN

COMPONENTS = ("mass", "height", "distance", "combined")


def random_heatmaps(rng, size):
    """Noise about any level, or blobs on nothing, or both."""
    level, spread, blobs = rng.uniform(-0.5, 0.3), rng.choice([0.0, 0.1, 1.0]), int(rng.integers(0, 4))
    maps = rng.normal(level, spread, (19, *size))
    rows, columns = np.mgrid[: size[0], : size[1]]
    for _ in range(blobs):
        row, column = rng.uniform(0, size)
        maps += rng.uniform(0.1, 1.2) * np.exp(-((rows - row) ** 2 + (columns - column) ** 2) / 2)
    return maps.astype(np.float32)


def random_cells(rng, size, count):
    """(count, 18, 2), some joints not detected."""
    cells = rng.integers(0, size, (count, 18, 2))
    cells[rng.random((count, 18)) < 0.2] = -1
    return cells


def random_points(rng):
    """Bodies with bones of every kind: too short, plausible, somewhat and far too long; some joints missing."""
    kinds = [(0, 0.2), (0.2, 0.6), (0.5, 2), (1.8, 3)]
    points = rng.normal(0, rng.choice([0.3, 1.0]), (18, 3))
    for start, end in pairwise(CHAIN):
        direction = rng.normal(size=3)
        length = rng.uniform(*kinds[rng.integers(4)])
        points[end] = points[start] + length * direction / np.linalg.norm(direction)
    points[rng.random(18) < rng.choice([0.0, 0.3, 0.8])] = np.nan
    return points


def compare(seed, *, largest):
    rng = np.random.default_rng([5, seed])
    size = tuple(int(side) for side in rng.integers(1, largest, 2))
    heatmaps, [cells], points = random_heatmaps(rng, size), random_cells(rng, size, 1), random_points(rng)
    others = random_cells(rng, size, int(rng.integers(0, 3)))
    plain = heatmaps.tolist(), cells.tolist(), points.tolist()
    for found, expected in (
        (quality_of_estimation(heatmaps, cells, points), reference_qoe.combined(*plain)),
        (
            quality_of_estimation(heatmaps, cells, points, others=others),
            reference_qoe.combined(*plain, others.tolist()),
        ),
    ):
        for name, values in zip(COMPONENTS, expected, strict=True):
            np.testing.assert_allclose(getattr(found, name), values, rtol=0, atol=1e-9, err_msg=f"{name}, {seed}")


def test_agrees_on_a_few_frames():
    for seed in range(50):
        compare(seed, largest=6)


@pytest.mark.slow
def test_agrees_on_a_thousand_frames():
    for seed in range(1000):
        compare(seed, largest=14)


@pytest.mark.slow
def test_agrees_on_maps_of_the_size_that_networks_give():
    for seed in range(1000, 1020):
        compare(seed, largest=41)
