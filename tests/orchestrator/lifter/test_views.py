import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.lifter.views import (
    DISTANCE,
    FitViews,
    believed,
    camera_of,
    company_of,
    fit_view,
    identity_of,
    scene_request,
)
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.scene import TRAIN_IDENTITIES, Figure
from tests.protocol.values.samples import SCENE

VIEWS = FitViews(frames=400, seed=3)
JOINTS = np.linspace(-0.5, 1.5, 54).reshape(18, 3)


def test_a_view_follows_from_the_seed_and_its_number_alone():
    assert fit_view(VIEWS, 7) == fit_view(replace(VIEWS, frames=9, frames_a_part=8), 7)
    assert fit_view(VIEWS, 7) != fit_view(VIEWS, 8)
    assert fit_view(VIEWS, 7) != fit_view(replace(VIEWS, seed=4), 7)


def test_scenes_are_of_train_identities_in_turn_and_of_both_sets_of_poses():
    requests = [scene_request(VIEWS, scene) for scene in range(100)]
    assert {request.split for request in requests} == {"train"}
    assert 50 <= sum(request.poses == "wide" for request in requests) <= 80
    assert {identity_of(scene) for scene in range(40)} == set(TRAIN_IDENTITIES)
    assert all(scene_request(replace(VIEWS, wide=0.0), scene).poses == "kinds" for scene in range(20))


def test_views_are_as_wide_as_they_say():
    drawn = [fit_view(VIEWS, number) for number in range(400)]
    distances = [one.viewpoint.distance for one in drawn]
    assert min(distances) >= DISTANCE[0]
    assert max(distances) <= DISTANCE[1]
    assert np.ptp(distances) > 8.5
    assert {one.depth_noise for one in drawn} == {"none", "d435i"}
    assert 0.04 < np.mean([one.hidden for one in drawn]) < 0.13
    assert 0.05 < np.mean([one.off is None for one in drawn]) < 0.16
    fields = [np.degrees(2 * np.arctan(one.intrinsics.width / 2 / one.intrinsics.fx)) for one in drawn]
    assert 50.0 <= min(fields) < 52.0
    assert 88.0 < max(fields) <= 90.0


def test_a_camera_is_turned_to_the_person_or_past_them():
    view = replace(fit_view(VIEWS, 1), aside=(0.1, -0.2, 0.3))
    straight = camera_of(replace(view, aside=(0.0, 0.0, 0.0)), SCENE, EnvironmentConfig())
    aside = camera_of(view, SCENE, EnvironmentConfig())
    assert np.subtract(aside.pose.target, straight.pose.target) == pytest.approx([0.1, -0.2, 0.3])
    assert aside.pose.position == straight.pose.position


def test_what_a_filter_believes_is_off_by_as_much_as_it_thinks():
    known = [one for one in (fit_view(VIEWS, number) for number in range(400)) if one.off is not None]
    ratios = []
    for view in known:
        state = believed(VIEWS, view, JOINTS, SCENE, 1.2)
        ratios.append(((state.mean - JOINTS) ** 2 / state.variance).mean())
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)


def test_a_filter_that_knows_nobody_begins_where_flights_do():
    state = believed(VIEWS, replace(fit_view(VIEWS, 1), off=None), JOINTS, SCENE, 1.2)
    assert not state.seen.any()
    assert state.mean[0].tolist() == [*SCENE.position, 1.2]


def test_somebody_else_stands_before_the_person_in_half_of_the_views():
    other = Figure(identity=2, pose=SCENE.pose, appearance=1, position=(9.0, 9.0), yaw=0.0)
    scene = replace(SCENE, bystanders=(other,))
    moved = 0
    for number in range(100):
        view = fit_view(VIEWS, number)
        camera = camera_of(view, scene, EnvironmentConfig())
        position = company_of(VIEWS, view, scene, camera).bystanders[0].position
        if position != other.position:
            moved += 1
            way = np.subtract(camera.pose.position[:2], SCENE.position)
            along = np.dot(np.subtract(position, SCENE.position), way) / np.dot(way, way)
            assert -0.8 < along < 1.8
    assert 30 < moved < 70
    assert company_of(VIEWS, fit_view(VIEWS, 1), SCENE, camera) is SCENE


@pytest.mark.parametrize("wrong", [{"frames": 0}, {"seed": -1}, {"wide": 1.5}, {"frames_a_part": 6}])
def test_views_that_can_not_be_are_refused(wrong):
    with pytest.raises(InvalidInput):
        FitViews(**wrong)
