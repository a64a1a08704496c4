from collections import Counter

import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.experiments.next_view.views import (
    CELLS,
    CENTRE,
    ArrayPart,
    ArrayViews,
    array_cameras,
    centre_of,
    scene_views,
)
from orchestrator.experiments.views import scenes_of
from orchestrator.pictures.view import Viewpoint
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.scene import Arm, BodyPose, Scene, Sun
from tests.orchestrator.experiments.test_views import ask

VIEWS = ArrayViews(train=80, test=40, seed=3)
UP_LEFT, LEFT, RIGHT, DOWN = CELLS.index((-1, 1)), CELLS.index((-1, 0)), CELLS.index((1, 0)), CELLS.index((0, -1))


def scene(yaw: float) -> Scene:
    arm = Arm(wrist=(0.0, 0.0, -0.9))
    return Scene(
        identity=3,
        pose=BodyPose(kind=0, left_arm=arm, right_arm=arm),
        appearance=1,
        position=(0.5, 0.0),
        yaw=yaw,
        sun=Sun(azimuth=0.0, elevation=1.0),
        ground="grass",
        background="brick",
    )


@pytest.mark.parametrize(
    ("yaw", "angle"), [(0.0, 0.0), (np.pi / 2, -90.0)], ids=["in front", "at the right of a person who faces north"]
)
def test_cameras_are_in_an_upright_plane_that_faces_the_person(yaw, angle):
    centre = Viewpoint(distance=3.0, angle=angle, altitude=2.0)
    cameras = array_cameras(centre, 0.75, scene(yaw), EnvironmentConfig())
    # The centre looks along -x, so its right is along y.
    places = {
        CENTRE: (3.5, 0.0, 2.0),
        LEFT: (3.5, -0.75, 2.0),
        RIGHT: (3.5, 0.75, 2.0),
        DOWN: (3.5, 0.0, 1.25),
        UP_LEFT: (3.5, -0.75, 2.75),
    }
    for cell, place in places.items():
        assert cameras[cell].pose.position == pytest.approx(place)
    assert {camera.pose.target for camera in cameras} == {(0.5, 0.0, EnvironmentConfig().target_height)}


def test_parts_have_every_scene_once_and_the_test_split_first():
    parts = replace(VIEWS, scenes_a_part=32).parts
    assert [(part.split, len(part.scenes)) for part in parts] == [
        ("test", 32),
        ("test", 8),
        ("train", 32),
        ("train", 32),
        ("train", 16),
    ]
    assert [number for part in parts if part.split == "train" for number in part.scenes] == list(range(80))
    assert VIEWS.count == 9 * 120


def test_scenes_take_people_and_poses_of_their_split_in_turn():
    for split, people, poses in (("train", range(40), range(6)), ("test", range(40, 60), range(8))):
        count = len(people) * len(poses)
        _, firsts = scene_views(VIEWS, ArrayPart(split=split, scenes=range(count)))
        seen = Counter((one.identity, one.kind) for one in firsts)
        assert set(seen) == {(person, pose) for person in people for pose in poses}
        assert set(seen.values()) == {1}


def test_the_splits_share_no_seed_and_no_place():
    seeds, centres = set(), set()
    for split in ("train", "test"):
        drawn, firsts = scene_views(VIEWS, ArrayPart(split=split, scenes=range(20)))
        seeds |= {one.seed for one in scenes_of(drawn, firsts, ask).values()}
        centres |= {centre_of(VIEWS, split, number).angle for number in range(20)}
    assert (len(seeds), len(centres)) == (40, 40)


def test_a_scene_does_not_depend_on_those_after_it():
    few = scene_views(VIEWS, ArrayPart(split="train", scenes=range(32, 40)))
    many = scene_views(replace(VIEWS, train=500), ArrayPart(split="train", scenes=range(32, 64)))
    for number, one in scenes_of(*few, ask).items():
        assert one == scenes_of(*many, ask)[number]


def test_centres_are_spread_evenly():
    centres = [centre_of(VIEWS, "train", number) for number in range(1000)]
    places = np.array([(one.distance, one.angle, one.altitude) for one in centres])
    for values, bounds in zip(places.T, [(2.0, 7.0), (-180.0, 180.0), (1.5, 2.5)], strict=True):
        counts, _ = np.histogram(values, bins=4, range=bounds)
        assert counts.sum() == 1000
        assert counts.min() > 200


@pytest.mark.parametrize("wrong", [{"train": 0}, {"test": 0}, {"seed": -1}, {"spacing": 0.0}, {"spacing": 1.5}])
def test_an_impossible_set_of_arrays_is_refused(wrong):
    with pytest.raises(InvalidInput):
        ArrayViews(**wrong)
