import math
from collections import Counter
from itertools import islice

import numpy as np
import pytest

from orchestrator.experiments.grid.views import (
    OBSERVED_CELLS,
    GridViews,
    camera_in,
    draws_of,
    glance_camera,
    subject_of,
)
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.grid.table import CENTRE, cell_of
from protocol.messages import SampleScene
from tests.orchestrator.experiments.grid.grid_workers import angle_of, sampled

VIEWS = GridViews(seed=3)
SCENE = sampled(SampleScene(seed=4, split="train")).scene


def subjects(split, views=VIEWS):
    return [one for one in (subject_of(views, number) for number in range(views.count)) if one.split == split]


def test_train_environments_come_first():
    assert [subject_of(VIEWS, number).split for number in (0, 79, 80, 119)] == ["train", "train", "test", "test"]


@pytest.mark.parametrize(("split", "identities", "poses"), [("train", range(40), 6), ("test", range(40, 60), 8)])
def test_every_identity_is_seen_twice_and_every_pose_as_often_as_any_other_or_once_more(split, identities, poses):
    seen = subjects(split)
    assert Counter(one.identity for one in seen) == dict.fromkeys(identities, 2)
    kinds = Counter(one.kind for one in seen)
    assert set(kinds) == set(range(poses))
    assert max(kinds.values()) - min(kinds.values()) <= 1


def test_no_identity_is_seen_twice_in_a_pose_before_it_was_seen_in_all():
    for split, pairs in (("train", 40 * 6), ("test", 20 * 8)):
        seen = subjects(split, GridViews(train=240, test=160))
        assert len({(one.identity, one.kind) for one in seen}) == pairs == len(seen)


def draws(views, number):
    return [one.seed for one in islice(draws_of(views, subject_of(views, number)), 3)]


def test_an_environment_does_not_depend_on_how_many_there_are():
    more = GridViews(train=200, test=90, seed=3)
    assert draws(VIEWS, 7) == draws(more, 7)
    assert draws(VIEWS, 80 + 7) == draws(more, 200 + 7)
    assert len({*draws(VIEWS, 7), *draws(VIEWS, 8), *draws(VIEWS, 87), *draws(GridViews(seed=4), 7)}) == 12


def test_every_cell_but_the_centre_is_seen_from():
    assert len(OBSERVED_CELLS) == 360
    assert CENTRE not in OBSERVED_CELLS


@pytest.mark.parametrize(("x", "y"), [(-9, -9), (1, 0), (0, -1), (9, 4)])
def test_a_camera_is_in_the_centre_of_its_cell_and_turned_to_the_chest(x, y):
    environment = EnvironmentConfig(target_height=1.3)
    camera = camera_in(cell_of(x, y), VIEWS, SCENE, environment)
    assert camera.pose.position == (0.25 + x, -0.125 + y, 1.6)
    assert camera.pose.target == (0.25, -0.125, 1.3)
    assert 2 * math.degrees(math.atan(320 / camera.intrinsics.fx)) == pytest.approx(70.0)


def test_a_glance_is_from_three_metres_in_front_at_the_same_altitude():
    class Request:
        scene = SCENE
        camera = glance_camera(0.0, VIEWS, SCENE, EnvironmentConfig())

    position = Request.camera.pose.position
    assert angle_of(Request) == 0.0
    assert (np.hypot(position[0] - 0.25, position[1] + 0.125), position[2]) == pytest.approx((3.0, 1.6))


@pytest.mark.parametrize("wrong", [{"train": 0}, {"test": 0}, {"seed": -1}])
def test_a_table_without_environments_of_a_split_is_refused(wrong):
    with pytest.raises(InvalidInput):
        GridViews(**wrong)
