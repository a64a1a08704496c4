"""A part of a picture has the bytes that the whole picture has there."""

import math

import msgspec
import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import ENCODINGS
from protocol.messages import Render
from protocol.packing.packing import unpack
from protocol.region import Region
from render_worker.scenes import sample_scene
from render_worker.worker import draw

pytestmark = pytest.mark.slow

SCENES = [sample_scene(4, "train"), sample_scene(5, "test", bystanders=1), sample_scene(6, "test")]
SIZES = ((320, 240), (161, 97), (33, 17), (1, 1))
NOISES = ("none", "d435i")
VIEWS = 24


def random_camera(scene, rng, noise):
    width, height = SIZES[rng.integers(len(SIZES))]
    distance, azimuth, altitude = rng.uniform((0.3, -math.pi, 0.3), (7.0, math.pi, 3.0)).tolist()
    x, y = scene.position
    pose = CameraPose((x + distance * math.cos(azimuth), y + distance * math.sin(azimuth), altitude), (x, y, 1.0))
    return Camera(pose, Intrinsics.from_horizontal_fov(width, height, float(rng.uniform(40, 110))), noise)


def random_region(intrinsics, rng):
    left, top = int(rng.integers(intrinsics.width)), int(rng.integers(intrinsics.height))
    return Region(
        left, top, int(rng.integers(1, intrinsics.width - left + 1)), int(rng.integers(1, intrinsics.height - top + 1))
    )


def border_regions(intrinsics):
    """The corners' pixels, the outermost rows and columns, and all of the picture."""
    width, height = intrinsics.width, intrinsics.height
    corners = [Region(left, top, 1, 1) for left in (0, width - 1) for top in (0, height - 1)]
    rows = [Region(0, top, width, 1) for top in (0, height - 1)]
    columns = [Region(left, 0, 1, height) for left in (0, width - 1)]
    return [*corners, *rows, *columns, Region.seen_by(intrinsics)]


def require_same(whole, part, region):
    expected = whole.part(region)
    assert part.region == region
    assert part.camera == whole.camera
    assert part.rgb.tobytes() == expected.rgb.tobytes()
    assert part.depth.tobytes() == expected.depth.tobytes()
    assert (part.rgb.shape[:2], part.depth.shape) == (region.shape, region.shape)
    np.testing.assert_array_equal(part.joints, whole.joints)
    np.testing.assert_array_equal(part.visible, whole.visible)


@pytest.mark.parametrize("truth", [False, True], ids=["no truth", "truth"])
@pytest.mark.parametrize("noise", NOISES)
def test_any_part_of_any_view_is_what_the_whole_picture_shows_there(renderer, noise, truth):
    rng = np.random.default_rng(NOISES.index(noise))
    for number in range(VIEWS):
        scene = SCENES[number % len(SCENES)]
        camera = random_camera(scene, rng, noise)
        whole = renderer.render(scene, camera, truth=truth)
        for _ in range(3):
            region = random_region(camera.intrinsics, rng)
            require_same(whole, renderer.render(scene, camera, region=region, truth=truth), region)


@pytest.mark.parametrize("noise", NOISES)
def test_parts_at_the_borders_are_what_the_whole_picture_shows_there(renderer, look_at, noise):
    camera = msgspec.structs.replace(look_at(SCENES[0], 40, 1.2, size=(160, 120)), depth_noise=noise)
    whole = renderer.render(SCENES[0], camera, truth=True)
    for region in border_regions(camera.intrinsics):
        require_same(whole, renderer.render(SCENES[0], camera, region=region, truth=True), region)


def test_a_part_between_two_whole_pictures_changes_neither(renderer, look_at):
    camera = look_at(SCENES[0], 0, 2.5, size=(160, 120))
    before = renderer.render(SCENES[0], camera)
    renderer.render(SCENES[0], camera, region=Region(10, 20, 30, 40))
    after = renderer.render(SCENES[0], camera)
    assert before.region is after.region is None
    assert before.rgb.tobytes() == after.rgb.tobytes()
    assert before.depth.tobytes() == after.depth.tobytes()


def test_joints_outside_of_a_part_are_visible_as_they_are_in_the_whole_picture(renderer, look_at):
    scene = SCENES[0]
    camera = look_at(scene, 90, 2.5)
    whole = renderer.render(scene, camera, truth=True)
    part = renderer.render(scene, camera, region=Region(0, 0, 2, 2), truth=True)
    assert 0 < whole.visible.sum() < 18
    np.testing.assert_array_equal(part.visible, whole.visible)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_part_is_packed_as_a_whole_picture_is(renderer, look_at, encoding):
    region = Region(50, 20, 61, 83)
    scene, camera = SCENES[0], look_at(SCENES[0], 0, 2.5, size=(160, 120))
    plain = renderer.render(scene, camera, region=region)
    frame = draw(Render(scene=scene, camera=camera, region=region, encoding=encoding), renderer)
    assert (frame.encoding, frame.region) == (encoding, region)
    opened = unpack(frame)
    assert opened.depth.tobytes() == plain.depth.tobytes()
    if encoding == "jpeg":
        assert np.abs(opened.rgb.astype(int) - plain.rgb).mean() < 8
    else:
        assert opened.rgb.tobytes() == plain.rgb.tobytes()
