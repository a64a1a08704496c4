"""Real renders, on whatever OpenGL this machine has."""

import hashlib
import os
import subprocess
import sys

import msgspec
import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics, back_project, project
from protocol.config import RenderConfig
from protocol.errors import InvalidInput
from protocol.scene import Arm, BodyPose, Head, Sun
from protocol.skeleton import Joint
from render_worker.opengl import OpenGlRenderer
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

pytestmark = pytest.mark.slow

OPEN_ARMS = BodyPose(2, Arm((0.25, 0.7, -0.6)), Arm((0.25, -0.7, -0.6)), head=Head())
SCENE = msgspec.structs.replace(sample_scene(3, "test"), pose=OPEN_ARMS, ground="concrete", background="sky-overcast")
FACE = (Joint.NOSE, Joint.LEFT_EYE, Joint.RIGHT_EYE)
SMALL = (160, 120)


def digest(frame) -> str:
    return hashlib.sha256(frame.rgb.tobytes() + frame.depth.tobytes()).hexdigest()


def test_a_frame_has_the_size_and_types_that_were_asked_for(renderer, look_at):
    for size in ((640, 480), (161, 97), (17, 33), (1, 1)):
        frame = renderer.render(SCENE, look_at(SCENE, 0, 3, size=size))
        assert frame.rgb.shape == (size[1], size[0], 3)
        assert frame.rgb.dtype == np.uint8
        assert frame.depth.shape == (size[1], size[0])
        assert frame.depth.dtype == np.float32
        assert frame.joints is None
        assert frame.visible is None
        assert frame.timings["render"] > 0


def test_the_depth_of_the_ground_is_the_analytic_one(renderer):
    # A camera 1.5 m up, looking away from the person.
    camera = Camera(CameraPose((2, 0, 1.5), (5, 0, 0.2)), Intrinsics.from_horizontal_fov(640, 480, 70))
    depth = renderer.render(SCENE, camera).depth
    rows, columns = np.mgrid[200:480:40, 0:640:80]
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float)
    on_ray = back_project(pixels, np.ones(len(pixels)), camera)
    # Along the ray from the eye, height falls from 1.5 to that of the point at depth 1: the ground is at depth
    # 1.5 / (1.5 - height).
    expected = 1.5 / (1.5 - on_ray[:, 2])
    np.testing.assert_allclose(depth[rows.ravel(), columns.ravel()], expected, atol=1e-3)


def test_every_measured_point_of_the_empty_floor_is_on_the_floor(renderer):
    camera = Camera(CameraPose((1.5, 1.5, 2.0), (6, 4, 0.0)), Intrinsics(321, 201, 250.0, 260.0, 150.3, 110.9))
    depth = renderer.render(SCENE, camera).depth
    rows, columns = np.nonzero((depth > 0) & (depth < 8))
    points = back_project(np.stack([columns, rows], 1).astype(float), depth[rows, columns].astype(float), camera)
    assert len(points) > 1000
    np.testing.assert_allclose(points[:, 2], 0, atol=1e-3)


def test_the_sky_has_no_depth(renderer, look_at):
    depth = renderer.render(SCENE, look_at(SCENE, 0, 3, altitude=0.6)).depth
    assert (depth[:20] == 0).all()
    assert np.isfinite(depth).all()


def test_true_joints_lie_under_the_surface_at_their_pixels(renderer, look_at):
    camera = look_at(SCENE, 0, 2.5)
    frame = renderer.render(SCENE, camera, truth=True)
    assert frame.visible.all()
    x, y, distance = project(frame.joints, camera).T
    surface = frame.depth[np.rint(y).astype(int), np.rint(x).astype(int)]
    assert (surface > 0).all()
    assert (distance - surface > -0.02).all()
    assert (distance - surface < 0.16).all()


def test_the_face_is_visible_from_the_front_and_not_from_behind(renderer, look_at):
    for identity in range(0, 60, 7):
        scene = msgspec.structs.replace(SCENE, identity=identity, appearance=identity)
        front = renderer.render(scene, look_at(scene, 0, 2.5), truth=True)
        behind = renderer.render(scene, look_at(scene, 180, 2.5), truth=True)
        assert front.visible[list(FACE)].all()
        assert not behind.visible[list(FACE)].any()
        assert behind.visible[[Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER, Joint.LEFT_HIP]].all()


def test_from_the_left_the_right_arm_is_hidden(renderer, look_at):
    frame = renderer.render(SCENE, look_at(SCENE, 90, 2.5), truth=True)
    assert frame.visible[[Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW, Joint.LEFT_WRIST, Joint.LEFT_EAR]].all()
    assert not frame.visible[[Joint.RIGHT_SHOULDER, Joint.RIGHT_ELBOW, Joint.RIGHT_EAR]].any()


def test_seen_from_the_front_the_persons_left_is_on_the_right_of_the_image(renderer, look_at):
    camera = look_at(SCENE, 0, 2.5)
    frame = renderer.render(SCENE, camera, truth=True)
    x = project(frame.joints, camera)[:, 0]
    assert x[Joint.LEFT_WRIST] > x[Joint.LEFT_SHOULDER] > x[Joint.NECK] > x[Joint.RIGHT_SHOULDER] > x[Joint.RIGHT_WRIST]


def test_the_person_stands_on_the_ground(renderer, look_at):
    frame = renderer.render(SCENE, look_at(SCENE, 0, 3), truth=True)
    rows, columns = np.nonzero(frame.depth > 0)
    points = back_project(
        np.stack([columns, rows], 1).astype(float), frame.depth[rows, columns].astype(float), frame.camera
    )
    near = np.hypot(*(points[:, :2] - SCENE.position).T) < 0.6
    assert points[near, 2].min() > -2e-3
    assert points[near, 2].max() == pytest.approx(frame.joints[Joint.NOSE, 2] + 0.13, abs=0.05)


def test_the_sun_casts_a_shadow_to_the_other_side(renderer):
    scene = msgspec.structs.replace(SCENE, position=(0.0, 0.0), sun=Sun(azimuth=0.0, elevation=0.8))
    camera = Camera(CameraPose((0.01, -4.0, 3.5), (0.0, 0.0, 0.3)), Intrinsics.from_horizontal_fov(320, 240, 70))
    frame = renderer.render(scene, camera)
    # On the ground, 0.8 m from the person, away from the sun and towards it.
    places = project(np.array([[-0.8, 0.0, 0.0], [0.8, 0.0, 0.0]]), camera)
    shaded, lit = (frame.rgb[round(y), round(x)].astype(int).sum() for x, y, _ in places)
    assert shaded < 0.8 * lit


def test_warm_and_cold_caches_give_the_same_bytes(assets, look_at):
    scenes = [sample_scene(seed, "test") for seed in range(4)]
    views = [(scene, look_at(scene, 30, 3, size=SMALL)) for scene in scenes]
    warm, cold = OpenGlRenderer(assets, scenes_kept=2), OpenGlRenderer(assets)
    try:
        first = [digest(warm.render(*view, truth=True)) for view in views]
        # More scenes than are kept: some come again from the cache, others are made again.
        again = [digest(warm.render(*view, truth=True)) for view in reversed(views)][::-1]
        alone = [digest(cold.render(*view, truth=True)) for view in views[:2]]
    finally:
        warm.close()
        cold.close()
    assert first == again
    assert first[:2] == alone
    assert len(set(first)) == len(first)


def test_another_process_draws_the_same_bytes(renderer, look_at):
    camera = look_at(SCENE, 30, 3)
    program = (
        "import sys, hashlib, msgspec\n"
        "from protocol.camera import Camera\nfrom protocol.config import RenderConfig\n"
        "from protocol.scene import Scene\n"
        "from render_worker.renderer import open_renderer\n"
        "scene, camera = msgspec.json.decode(sys.stdin.buffer.read(), type=tuple[Scene, Camera])\n"
        "frame = open_renderer(RenderConfig()).render(scene, camera)\n"
        "print(hashlib.sha256(frame.rgb.tobytes() + frame.depth.tobytes()).hexdigest())\n"
    )
    encoded = msgspec.json.encode((SCENE, camera))
    done = subprocess.run([sys.executable, "-c", program], input=encoded, capture_output=True, check=True)
    assert done.stdout.decode().strip() == digest(renderer.render(SCENE, camera))


def test_depth_noise_is_off_by_default_and_the_camera_s_own_when_on(renderer, look_at):
    camera = look_at(SCENE, 20, 2.5)
    noisy_camera = msgspec.structs.replace(camera, depth_noise="d435i")
    clean = renderer.render(SCENE, camera, truth=True)
    noisy = renderer.render(SCENE, noisy_camera, truth=True)
    again = renderer.render(SCENE, noisy_camera, truth=True)
    np.testing.assert_array_equal(noisy.depth, again.depth)
    np.testing.assert_array_equal(noisy.rgb, clean.rgb)
    np.testing.assert_array_equal(noisy.visible, clean.visible)
    both = (noisy.depth > 0) & (clean.depth < 3)
    assert 0.002 < (noisy.depth[both] - clean.depth[both]).std() < 0.03
    assert (noisy.depth == 0).sum() > (clean.depth == 0).sum()


def test_a_ground_that_nobody_knows_is_refused(renderer, look_at):
    scene = msgspec.structs.replace(SCENE, ground="lava")
    with pytest.raises(InvalidInput, match="lava"):
        renderer.render(scene, look_at(scene, 0, 3))


def test_threads_do_not_change_the_bytes(renderer, look_at):
    camera = look_at(SCENE, 30, 3, size=SMALL)
    two = open_renderer(RenderConfig(threads=2))
    try:
        assert digest(two.render(SCENE, camera)) == digest(renderer.render(SCENE, camera))
    finally:
        two.close()
        os.environ["LP_NUM_THREADS"] = "0"


def with_bystander(ahead, left):
    """The scene with somebody more, some metres ahead of the person and to their left."""
    (fx, fy), (x, y) = SCENE.facing, SCENE.position
    somebody = msgspec.structs.replace(
        SCENE.person, identity=45, appearance=9, position=(x + ahead * fx - left * fy, y + ahead * fy + left * fx)
    )
    return msgspec.structs.replace(SCENE, bystanders=(somebody,))


def test_a_bystander_is_drawn_where_they_stand_and_the_truth_stays_the_persons(renderer, look_at):
    scene = with_bystander(ahead=0.0, left=1.5)
    camera = look_at(SCENE, 0, 4)
    alone, both = (renderer.render(one, camera, truth=True) for one in (SCENE, scene))
    np.testing.assert_array_equal(both.joints, alone.joints)
    np.testing.assert_array_equal(both.visible, alone.visible)
    # Seen from the front, the person's left is on the right. The chest of somebody 4 m away is before the ground there.
    [[x, y, distance]] = project(np.array([[*scene.bystanders[0].position, 1.2]]), camera)
    assert both.depth[round(y), round(x)] == pytest.approx(distance, abs=0.25)
    changed = (np.abs(both.depth - alone.depth) > 0.05).any(axis=0).nonzero()[0]
    assert changed.min() > 320
    assert abs(changed.mean() - x) < 20


def test_a_bystander_in_front_hides_the_persons_joints(renderer, look_at):
    camera = look_at(SCENE, 0, 4)
    trunk = [Joint.NECK, Joint.LEFT_HIP, Joint.RIGHT_HIP, Joint.LEFT_KNEE]
    behind, before = (renderer.render(with_bystander(ahead, 0.0), camera, truth=True) for ahead in (-1.5, 1.0))
    assert behind.visible.all()
    assert not before.visible[trunk].any()
    alone = renderer.render(SCENE, camera, truth=True)
    np.testing.assert_array_equal(before.joints, alone.joints)


def test_a_bystanders_shadow_falls_on_the_ground(renderer):
    scene = msgspec.structs.replace(SCENE, position=(0.0, 0.0), sun=Sun(azimuth=0.0, elevation=0.8))
    bystander = msgspec.structs.replace(scene.person, position=(0.0, 2.0))
    both = msgspec.structs.replace(scene, bystanders=(bystander,))
    camera = Camera(CameraPose((0.01, -4.0, 3.5), (0.0, 0.0, 0.3)), Intrinsics.from_horizontal_fov(320, 240, 70))
    [[x, y, _]] = project(np.array([[-0.8, 2.0, 0.0]]), camera)
    lit, shaded = (renderer.render(one, camera).rgb[round(y), round(x)].astype(int).sum() for one in (scene, both))
    assert shaded < 0.8 * lit
