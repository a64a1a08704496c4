import itertools
import math

import numpy as np
import pytest

from orchestrator.experiments.flights import FlightSet, courses, filter_columns, scene_view, viewpoints
from orchestrator.experiments.views import FAMILIES, ViewSet
from orchestrator.pictures.view import Viewpoint
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.pose_estimate import FilterState, PoseEstimate

ENVIRONMENT = EnvironmentConfig()


def way(path, scene=3, steps=40) -> list[Viewpoint]:
    return list(viewpoints(path, 0, scene, steps, ENVIRONMENT))


def place(viewpoint: Viewpoint) -> tuple[float, float]:
    angle = math.radians(viewpoint.angle)
    return viewpoint.distance * math.cos(angle), viewpoint.distance * math.sin(angle)


def test_every_scene_is_flown_along_both_paths_with_each_noise():
    flown = courses(FlightSet(scenes=3))
    assert [one.number for one in flown] == list(range(12))
    assert len({(one.scene, one.path, one.depth_noise) for one in flown}) == 12


@pytest.mark.parametrize("path", ["circle", "front"])
@pytest.mark.parametrize("scene", range(8))
def test_no_drone_flies_faster_than_it_can_or_into_the_keep_out(path, scene):
    places = way(path, scene)
    for before, after in itertools.pairwise(places):
        assert math.dist(place(before), place(after)) <= 0.5
    assert min(one.distance for one in places) > ENVIRONMENT.keep_out_radius


def test_a_circle_goes_once_around_the_person():
    angles = np.unwrap(np.radians([one.angle for one in way("circle")]))
    assert angles[-1] - angles[0] == pytest.approx(39 * 0.5 / 3.0)
    assert {one.distance for one in way("circle")} == {3.0}
    assert all(-180 <= one.angle < 180 for one in way("circle"))


def test_an_approach_begins_beside_or_behind_the_person_and_ends_in_front():
    starts = [way("front", scene)[0] for scene in range(30)]
    assert all(one.distance == 6.0 and 90 <= abs(one.angle) <= 180 for one in starts)
    assert {one.angle > 0 for one in starts} == {True, False}
    assert (way("front")[-1].distance, way("front")[-1].angle) == pytest.approx((ENVIRONMENT.front_distance, 0.0))


def test_twenty_scenes_have_every_identity_and_every_pose():
    seen = [scene_view(ViewSet(), scene, Viewpoint()) for scene in range(20)]
    assert {one.identity for one in seen} == set(range(40, 60))
    assert {one.kind for one in seen} == set(range(8))


def test_twenty_scenes_in_families_have_every_identity_and_every_family():
    seen = [scene_view(ViewSet(poses="families"), scene, Viewpoint()) for scene in range(20)]
    assert {one.identity for one in seen} == set(range(40, 60))
    assert {one.poses for one in seen} == set(FAMILIES)
    assert {one.kind for one in seen} == {0}


def test_the_filters_columns_by_hand():
    state = FilterState.initial((1.0, 0.0, 0.0))
    nothing, none = np.full((18, 3), np.nan), np.zeros(18)
    observation = PoseEstimate(
        keypoints=nothing[:, :2],
        points=nothing,
        mass=none,
        height=none,
        distance=none,
        quality=none,
        filter=state,
        joints=np.zeros((18, 3)),
    )
    found = filter_columns(observation)
    assert found["filter_x"] == pytest.approx(np.ones(18))
    assert found["filter_error"] == pytest.approx(np.ones(18))
    # Three variances of 1 m².
    assert found["deviation"] == pytest.approx(np.full(18, math.sqrt(3)))
    assert not found["seen"].any()


@pytest.mark.parametrize("wrong", [{"scenes": 0}, {"steps": 1}, {"depth_noises": ()}])
def test_impossible_flights_are_refused(wrong):
    with pytest.raises(InvalidInput):
        FlightSet(**wrong)
