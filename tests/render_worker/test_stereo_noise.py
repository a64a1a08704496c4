import math

import msgspec
import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.region import Region
from protocol.scene import Arm, BodyPose, Scene, Sun
from render_worker.scenes import sample_scene
from render_worker.stereo_noise import (
    BASELINE,
    FARTHEST,
    FOCAL,
    SUBPIXEL_ERROR,
    depth_error,
    measure_depth,
    measure_part,
    noise_seed,
    seen_around,
)

PICTURE_FOCAL = 457.0


def wall(depth: float, shape: tuple[int, int] = (200, 300)) -> np.ndarray:
    return np.full(shape, depth, np.float32)


def test_the_error_by_hand():
    # 848 px over 87°: 446.8 px; with 50 mm and 0.08 px, 2 m are off by 4 · 0.08 / (446.8 · 0.05) = 14.3 mm.
    assert pytest.approx(446.8, abs=0.1) == FOCAL
    assert depth_error(2.0) == pytest.approx(0.0143, abs=1e-4)


def test_the_error_grows_with_the_square_of_the_distance():
    spread = {}
    for depth in (1.0, 2.0, 4.0):
        measured = measure_depth(wall(depth), PICTURE_FOCAL, seed=1)
        spread[depth] = measured[measured > 0].std()
        assert spread[depth] == pytest.approx(depth_error(depth), rel=0.15)
        assert measured[measured > 0].mean() == pytest.approx(depth, rel=0.005)
    assert spread[4.0] / spread[2.0] == pytest.approx(4, rel=0.15)


def test_the_same_seed_measures_the_same_and_another_one_does_not():
    first = measure_depth(wall(2.0), PICTURE_FOCAL, seed=1)
    np.testing.assert_array_equal(first, measure_depth(wall(2.0), PICTURE_FOCAL, seed=1))
    assert (first != measure_depth(wall(2.0), PICTURE_FOCAL, seed=2)).any()


def test_nothing_and_too_far_are_not_measured():
    assert not measure_depth(wall(0.0), PICTURE_FOCAL, seed=1).any()
    assert not measure_depth(wall(FARTHEST * 1.5), PICTURE_FOCAL, seed=1).any()


def test_a_near_thing_casts_an_occlusion_shadow_to_its_left():
    depth = wall(4.0)
    depth[:, 150:200] = 1.0
    measured = measure_depth(depth, PICTURE_FOCAL, seed=1)
    # Disparities differ by 457 · 0.05 · (1/1 - 1/4) = 17.1 px.
    shadow = int(PICTURE_FOCAL * BASELINE * (1 - 1 / 4))
    assert not measured[:, 150 - shadow : 150].any()
    assert (measured[:, : 150 - shadow - 3] > 0).all()
    assert (measured[:, 203:] > 0).all()


def test_depth_edges_leave_holes():
    depth = wall(4.0)
    depth[:, 150:] = 1.0
    measured = measure_depth(depth, PICTURE_FOCAL, seed=1)
    assert not measured[:, 149:151].any()


def test_a_part_is_measured_as_it_is_within_the_whole():
    rng = np.random.default_rng(3)
    for number in range(200):
        height, width = rng.integers(1, 60, 2).tolist()
        focal = float(rng.uniform(5, 900))
        blocks = rng.uniform(0.3, 12.0, (height // 5 + 1, width // 7 + 1)).astype(np.float32)
        depth = np.kron(blocks, np.ones((5, 7), np.float32))[:height, :width]
        depth[rng.random(depth.shape) < 0.1] = 0
        left, top = int(rng.integers(width)), int(rng.integers(height))
        region = Region(left, top, int(rng.integers(width - left)) + 1, int(rng.integers(height - top)) + 1)
        around = seen_around(region, Intrinsics(width, height, focal, focal, 0.0, 0.0), 0.3)
        measured = measure_part(around.part(depth), around, region, depth.shape, focal, number)
        assert measured.tobytes() == region.part(measure_depth(depth, focal, number)).tobytes()


def test_no_more_is_needed_around_a_part_than_the_nearest_thing_s_shadow_reaches():
    picture = Intrinsics.from_horizontal_fov(640, 480, 70.0)
    # 457 px · 50 mm / 1 m are 22.9 px of disparity.
    assert seen_around(Region(100, 50, 20, 10), picture, 1.0) == Region(99, 49, 45, 12)
    assert seen_around(Region(0, 470, 630, 10), picture, 1.0) == Region(0, 469, 640, 11)


def test_disparities_come_in_steps():
    measured = measure_depth(wall(3.0), PICTURE_FOCAL, seed=1).astype(float)
    steps = FOCAL * BASELINE / measured[measured > 0] * 32
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)
    assert SUBPIXEL_ERROR > 1 / 32


def test_a_scene_of_one_person_has_the_noise_that_it_had_before_scenes_had_bystanders():
    arm = Arm((0.0, 0.25, -0.75))
    scene = Scene(41, BodyPose(0, arm, arm), 7, (0.5, -0.25), 0.75, Sun(0.125, 0.5), "grass", "hall-brick")
    camera = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5))
    assert noise_seed(scene, camera) == 7816520231149173549


def test_the_seed_is_the_requests():
    scene = sample_scene(1, "test")
    camera = Camera(CameraPose((3, 0, 1.5), (0, 0, 1)), Intrinsics.from_horizontal_fov(64, 48, 70))
    moved = msgspec.structs.replace(camera, pose=CameraPose((3, 0, 1.5 + 1e-9), (0, 0, 1)))
    assert noise_seed(scene, camera) == noise_seed(sample_scene(1, "test"), camera)
    assert noise_seed(scene, camera) != noise_seed(scene, moved)
    assert noise_seed(scene, camera) != noise_seed(sample_scene(2, "test"), camera)
    assert math.log2(noise_seed(scene, camera)) < 64
