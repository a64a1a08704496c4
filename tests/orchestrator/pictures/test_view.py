import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from orchestrator.pictures.view import (
    LONGEST_STEP,
    Look,
    Viewpoint,
    a_step_before,
    camera_at,
    parsed_size,
    picture_files,
    view_config,
    write_picture,
)
from protocol.camera import project
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidConfig, InvalidInput
from protocol.scene import Arm, BodyPose, Scene, Sun


def scene(yaw: float) -> Scene:
    arm = Arm(wrist=(0.0, 0.0, -0.9))
    return Scene(
        identity=40,
        pose=BodyPose(kind=0, left_arm=arm, right_arm=arm),
        appearance=0,
        position=(1.0, 2.0),
        yaw=yaw,
        sun=Sun(azimuth=0.0, elevation=1.0),
        ground="grass",
        background="brick",
    )


@pytest.mark.parametrize(
    ("yaw", "angle", "position"),
    [
        (0.0, 0.0, (4.0, 2.0, 1.6)),
        (0.0, 90.0, (1.0, 5.0, 1.6)),
        (math.pi / 2, 0.0, (1.0, 5.0, 1.6)),
        (math.pi / 2, 180.0, (1.0, -1.0, 1.6)),
        (0.0, -90.0, (1.0, -1.0, 1.6)),
    ],
)
def test_the_camera_stands_at_its_angle_from_the_persons_front(yaw, angle, position):
    camera = camera_at(Viewpoint(distance=3.0, angle=angle, altitude=1.6), scene(yaw), EnvironmentConfig())
    assert camera.pose.position == pytest.approx(position)


@pytest.mark.parametrize(
    "viewpoint", [Viewpoint(distance=1.5, altitude=1.0), Viewpoint(distance=9.0), Viewpoint(distance=0.5, altitude=0.2)]
)
def test_a_step_before_the_camera_was_near_and_looked_at_the_same_target(viewpoint):
    environment, random = EnvironmentConfig(), np.random.default_rng(0)
    camera = camera_at(viewpoint, scene(0.3), environment)
    befores = [a_step_before(camera, environment, random) for _ in range(200)]
    positions = np.array([one.pose.position for one in befores])
    away = np.linalg.norm(positions - camera.pose.position, axis=1)
    assert away.max() <= LONGEST_STEP
    assert away.min() > 0
    assert (
        np.hypot(*(positions[:, :2] - (1.0, 2.0)).T).min()
        >= min(viewpoint.distance, environment.keep_out_radius) - 1e-9
    )
    assert positions[:, 2].min() >= min(viewpoint.altitude, environment.min_altitude)
    assert {one.pose.target for one in befores} == {camera.pose.target}


def test_the_person_is_in_the_middle_of_the_picture():
    environment = EnvironmentConfig()
    camera = camera_at(Viewpoint(distance=2.5, angle=40.0, altitude=2.2), scene(1.0), environment)
    [[x, y, _]] = project(np.array([[1.0, 2.0, environment.target_height]]), camera)
    assert (x, y) == pytest.approx((319.5, 239.5))


@pytest.mark.parametrize(
    "wrong", [{"distance": 0.0}, {"distance": math.nan}, {"angle": math.inf}, {"altitude": math.nan}]
)
def test_an_impossible_viewpoint_is_refused(wrong):
    with pytest.raises(InvalidInput):
        Viewpoint(**wrong)


def test_a_size_is_width_by_height():
    assert parsed_size("848x480") == (848, 480)
    camera = view_config(None, "848x480").environment.camera
    assert (camera.width, camera.height) == (848, 480)


@pytest.mark.parametrize("text", ["", "640", "640x", "0x480", "640x9000", "-640x480", "640x480x3", "a x b"])
def test_what_is_no_size_is_refused(text):
    with pytest.raises(InvalidInput, match="640x480"):
        parsed_size(text)


def test_a_configuration_to_look_with_is_read_from_its_file(tmp_path):
    path = tmp_path / "wide.toml"
    path.write_text("[perception]\ninput_height = 256\n[environment.camera]\nwidth = 100\nheight = 50\n")
    assert view_config(path, None).perception.input_height == 256
    camera = view_config(path, "848x480").environment.camera
    assert (camera.width, camera.height) == (848, 480)


def test_a_wrong_configuration_to_look_with_is_named(tmp_path):
    (tmp_path / "wrong.toml").write_text("[camera]\n")
    with pytest.raises(InvalidConfig, match="camera"):
        view_config(tmp_path / "wrong.toml", None)


def test_each_scene_gets_a_file_of_its_own(tmp_path):
    assert picture_files([7], None) == {7: Path("scene-7.png")}
    assert picture_files([7], Path("x/hand.jpg")) == {7: Path("x/hand.jpg")}
    assert picture_files([1, 2], Path("new")) == {1: Path("new/scene-1.png"), 2: Path("new/scene-2.png")}
    (tmp_path / "dir.d").mkdir()
    assert picture_files([1], tmp_path / "dir.d") == {1: tmp_path / "dir.d" / "scene-1.png"}


def test_many_scenes_do_not_go_into_one_file():
    with pytest.raises(InvalidInput, match="2 scenes"):
        picture_files([1, 2], Path("one.png"))


def test_a_file_that_is_no_picture_is_refused_before_any_work():
    with pytest.raises(InvalidInput, match=r"\.png"):
        picture_files([1], Path("report.pdf"))


def test_a_written_picture_has_its_colours(tmp_path):
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[..., 0] = 200
    write_picture(tmp_path / "deep" / "red.png", pixels)
    read = cv2.imread(str(tmp_path / "deep" / "red.png"))
    assert tuple(read[4, 4]) == (0, 0, 200)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["red.png"]


@pytest.mark.parametrize("bystanders", [-1, 9])
def test_a_crowd_is_not_looked_at(bystanders):
    with pytest.raises(InvalidInput, match="0 to 8 bystanders"):
        Look(seeds=(1,), bystanders=bystanders)
