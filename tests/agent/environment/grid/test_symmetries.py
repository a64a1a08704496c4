"""Environments that are turned and mirrored, against ones made for the way that their person then faces."""

import math

import numpy as np
import pytest

from agent.environment.grid.cells import POSITIONS
from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.symmetries import SYMMETRIES, Symmetry, walked_map, with_symmetries
from protocol.grid.table import CENTRE, cell_of
from protocol.grid_config import GridConfig
from protocol.scene import Split
from protocol.skeleton import Joint
from tests.agent.environment.grid.tables import quality_around, table


@pytest.fixture(scope="module")
def grid_map() -> GridMap:
    return GridMap.of_table(table(), "train")


def test_a_view_is_seen_from_where_its_cell_went() -> None:
    """Three metres east and one north; a quarter turn counter-clockwise makes it one west and three north."""
    turned, mirrored, both = Symmetry(1, False), Symmetry(0, True), Symmetry(1, True)
    assert turned.sources[cell_of(-1, 3)] == cell_of(3, 1)
    assert mirrored.sources[cell_of(3, -1)] == cell_of(3, 1)
    assert both.sources[cell_of(1, 3)] == cell_of(3, 1)


def test_the_eight_are_different_and_the_first_changes_nothing() -> None:
    assert len({tuple(symmetry.sources.tolist()) for symmetry in SYMMETRIES}) == 8
    assert np.array_equal(SYMMETRIES[0].sources, np.arange(len(POSITIONS)))
    assert all(symmetry.sources[CENTRE] == CENTRE for symmetry in SYMMETRIES)


def test_views_are_those_of_a_person_who_faces_that_way(grid_map: GridMap) -> None:
    many = with_symmetries(grid_map)
    assert len(many.places) == 8 * len(grid_map.places)
    for place, observations in zip(many.places, many.observations, strict=True):
        seen = quality_around(place.yaw)
        seen[CENTRE] = 0.0
        np.testing.assert_allclose(observations[:, 2:], seen, atol=0.01)
        assert np.array_equal(observations[:, :2], POSITIONS)
        assert -math.pi <= place.yaw <= math.pi


def test_uncertainty_goes_where_its_view_goes(grid_map: GridMap) -> None:
    many = with_symmetries(grid_map)
    for number, symmetry in enumerate(SYMMETRIES):
        own = slice(number * len(grid_map.places), (number + 1) * len(grid_map.places))
        assert np.array_equal(many.uncertainty[own], grid_map.uncertainty[:, symmetry.sources])
        assert np.array_equal(many.observations[own][:, :, 2], grid_map.observations[:, symmetry.sources, 2])


def test_in_a_mirror_left_and_right_change_places() -> None:
    observations = np.zeros((1, len(POSITIONS), 20), np.float32)
    observations[0, cell_of(3, 1), 2 + Joint.LEFT_WRIST] = 0.7
    seen = Symmetry(0, True).observations(observations)[0]
    assert seen[cell_of(3, -1), 2 + Joint.RIGHT_WRIST] == np.float32(0.7)
    assert np.count_nonzero(seen[:, 2:]) == 1


@pytest.mark.parametrize(
    ("split", "symmetries", "environments"), [("train", True, 32), ("train", False, 4), ("test", True, 2)]
)
def test_only_environments_to_train_on_are_turned(split: Split, symmetries: bool, environments: int) -> None:
    found = walked_map(table(), GridConfig(symmetries=symmetries), split)
    assert len(found.places) == len(found.observations) == len(found.uncertainty) == environments
