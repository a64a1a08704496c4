from collections import Counter

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.experiments.views import DRAWS_AT_ONCE, FAMILIES, ViewSet, camera_of, scenes_of, view
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.messages import Sampled
from protocol.scene import Arm, BodyPose, Scene, Sun

TEST = ViewSet(frames=320, split="test", seed=3)
IN_FAMILIES = replace(TEST, poses="families", views_a_scene=4)
SEEDS_BEFORE_FAMILIES = [1285449624, 1787934416, 659803976]


def sampled(request) -> Sampled:
    arm = Arm(wrist=(0.0, 0.0, -0.9))
    pose = BodyPose(kind=request.seed % 8, left_arm=arm, right_arm=arm)
    sun = Sun(azimuth=0.0, elevation=1.0)
    return Sampled(
        scene=Scene(
            identity=59,
            pose=pose,
            appearance=request.seed,
            position=(0.3, 0.1),
            yaw=1.0,
            sun=sun,
            ground="grass",
            background="brick",
        )
    )


def ask(requests):
    return map(sampled, requests)


def test_every_identity_of_the_split_is_seen_as_often_in_every_pose():
    seen = Counter((one.identity, one.kind) for one in (view(TEST, number) for number in range(TEST.frames)))
    assert set(seen) == {(identity, kind) for identity in range(40, 60) for kind in range(8)}
    assert set(seen.values()) == {2}


def test_people_of_training_have_no_pose_that_is_kept_for_tests():
    views = [view(replace(TEST, split="train"), number) for number in range(240)]
    assert {(one.identity, one.kind) for one in views} == {(person, kind) for person in range(40) for kind in range(6)}


def test_views_are_spread_evenly_over_distances_azimuths_and_altitudes():
    places = np.array(
        [(v.distance, v.angle, v.altitude) for v in (view(TEST, number).viewpoint for number in range(2000))]
    )
    for values, (low, high) in zip(places.T, [(1.5, 9.0), (-180.0, 180.0), (1.0, 2.5)], strict=True):
        counts, _ = np.histogram(values, bins=5, range=(low, high))
        assert counts.sum() == 2000
        assert counts.min() > 330


def test_a_view_depends_on_the_seed_and_its_number_alone():
    assert view(TEST, 7) == view(replace(TEST, frames=8), 7)
    assert view(TEST, 7).viewpoint != view(replace(TEST, seed=4), 7).viewpoint
    assert view(TEST, 7).viewpoint != view(TEST, 8).viewpoint


def test_a_scene_has_the_pose_and_the_identity_of_its_view():
    chosen = [view(TEST, number) for number in range(250)]
    scenes = scenes_of(TEST, chosen, ask)
    for one in chosen:
        assert (scenes[one.number].scene.identity, scenes[one.number].scene.pose.kind) == (one.identity, one.kind)
        assert scenes[one.number].scene.appearance == scenes[one.number].seed
    assert len({scene.seed for scene in scenes.values()}) == 250


def test_views_in_a_row_can_share_a_scene_and_never_a_place():
    shared = replace(TEST, views_a_scene=4)
    chosen = [view(shared, number) for number in range(250)]
    scenes = scenes_of(shared, chosen, ask)
    for one in chosen:
        assert scenes[one.number] == scenes[one.number // 4 * 4]
        assert (scenes[one.number].scene.identity, scenes[one.number].scene.pose.kind) == (one.identity, one.kind)
    assert len({scene.seed for scene in scenes.values()}) == 63
    assert [one.identity for one in chosen[:9]] == [40, 40, 40, 40, 41, 41, 41, 41, 42]
    assert len({one.viewpoint.angle for one in chosen}) == 250
    assert [one.viewpoint for one in chosen] == [view(TEST, number).viewpoint for number in range(250)]


def test_a_scene_does_not_depend_on_the_views_after_it():
    chosen = [view(TEST, number) for number in range(250)]
    few, many = scenes_of(TEST, chosen[:40], ask), scenes_of(TEST, chosen, ask)
    assert all(few[number] == many[number] for number in range(40))


def test_poses_that_are_never_drawn_are_an_error_and_no_endless_search():
    asked = []

    def only_idle(requests):
        asked.append(len(requests))
        return (
            Sampled(scene=replace(answer.scene, pose=replace(answer.scene.pose, kind=0))) for answer in ask(requests)
        )

    with pytest.raises(InvalidInput, match="poses"):
        scenes_of(TEST, [view(TEST, 20)], only_idle)
    assert max(asked) == DRAWS_AT_ONCE


def test_families_are_in_turn_and_everybody_is_seen_in_each_of_them_as_often():
    views = [view(replace(TEST, poses="families"), number) for number in range(200)]
    assert tuple(one.poses for one in views[:5]) == FAMILIES
    seen = Counter((one.identity, one.poses) for one in views)
    assert set(seen) == {(identity, family) for identity in range(40, 60) for family in FAMILIES}
    assert set(seen.values()) == {2}
    assert {one.kind for one in views} == {0}
    assert [one.viewpoint for one in views] == [view(TEST, number).viewpoint for number in range(200)]


def test_a_scene_in_a_family_is_asked_for_by_a_seed_of_its_own_whichever_views_come_with_it():
    asked = []

    def standing(requests):
        asked.extend(requests)
        return (Sampled(scene=replace(sampled(one).scene, appearance=one.seed)) for one in requests)

    chosen = [view(IN_FAMILIES, number) for number in range(40)]
    scenes = scenes_of(IN_FAMILIES, chosen, standing)
    assert [one.poses for one in asked] == [one.poses for one in chosen[::4]]
    assert len({one.seed for one in asked}) == 10
    assert all(scenes[one.number].scene.identity == one.identity for one in chosen)
    assert all(scenes[one.number].scene.appearance == scenes[one.number].seed for one in chosen)
    assert all(scenes[one.number] == scenes[one.number // 4 * 4] for one in chosen)
    # From the middle of a scene to the middle of another.
    alone = scenes_of(IN_FAMILIES, chosen[10:31], standing)
    assert all(alone[number] == scenes[number] for number in range(10, 31))


def test_a_set_of_views_that_was_written_before_there_were_families_is_one_of_the_kinds():
    written = msgspec.json.encode(TEST).replace(b',"poses":"kinds"', b"")
    assert b"poses" not in written
    assert msgspec.json.decode(written, type=ViewSet) == TEST


def test_seeds_of_scenes_in_the_kinds_stay_as_they_were():
    shared = replace(TEST, views_a_scene=4)
    scenes = scenes_of(shared, [view(shared, number) for number in range(12, 24)], ask)
    assert [scenes[number].seed for number in (12, 16, 20)] == SEEDS_BEFORE_FAMILIES


def test_a_camera_has_the_noise_that_is_asked_for():
    one = view(TEST, 5)
    scene = scenes_of(TEST, [one], ask)[5].scene
    environment = EnvironmentConfig()
    clean, noisy = (camera_of(one, scene, environment, noise) for noise in ("none", "d435i"))
    assert (clean.depth_noise, noisy.depth_noise) == ("none", "d435i")
    assert clean.pose == noisy.pose
    assert np.hypot(clean.pose.position[0] - 0.3, clean.pose.position[1] - 0.1) == pytest.approx(one.viewpoint.distance)


@pytest.mark.parametrize(
    "wrong",
    [{"frames": 0}, {"views_a_scene": 0}, {"seed": -1}, {"depth_noises": ()}, {"depth_noises": ("none", "none")}],
)
def test_an_impossible_set_of_views_is_refused(wrong):
    with pytest.raises(InvalidInput):
        ViewSet(**wrong)
