import math

import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics, project, world_to_camera
from protocol.region import Region
from protocol.scene import Scene
from render_worker.opengl.picture import clip_projection
from render_worker.opengl.shadowed import shadowed_ground, shadowed_region
from render_worker.scenes import sample_scene
from render_worker.surroundings.light import light_of
from render_worker.surroundings.surroundings import ground_patch


def crowd(scene: Scene, rng: np.random.Generator) -> list[np.ndarray]:
    """Points of everybody's surfaces: anywhere up to 0.6 m from where they stand, and 1.9 m high."""
    figures = (scene.person, *scene.bystanders)
    angle, radius = rng.uniform(-math.pi, math.pi, (len(figures), 50)), rng.uniform(0, 0.6, (len(figures), 50))
    height = rng.uniform(0, 1.9, (len(figures), 50))
    places = np.array([figure.position for figure in figures])[:, :, None]
    x, y = places[:, 0] + radius * np.cos(angle), places[:, 1] + radius * np.sin(angle)
    return list(np.stack([x, y, height], axis=-1).astype(np.float32))


def patch_of(scene: Scene) -> np.ndarray:
    light = light_of(scene)
    return ground_patch(light.centre, light.reach, 1.0)[0][:, :3]


def shadows(points: list[np.ndarray], towards_sun: tuple[float, float, float]) -> np.ndarray:
    """Where the sun's rays through points meet the ground."""
    above, sun = np.vstack(points).astype(float), np.array(towards_sun)
    return above - above[:, 2:] / sun[2] * sun


def region_of(ground: np.ndarray | None, camera: Camera, region: Region) -> Region | None:
    clip = clip_projection(camera.intrinsics) @ world_to_camera(camera.pose)
    return shadowed_region(ground, clip, camera.intrinsics, region)


def camera_near(scene: Scene, rng: np.random.Generator) -> Camera:
    distance, azimuth, altitude = rng.uniform((1.0, -math.pi, 0.3), (8.0, math.pi, 3.0)).tolist()
    x, y = scene.position
    eye = (x + distance * math.cos(azimuth), y + distance * math.sin(azimuth), altitude)
    return Camera(CameraPose(eye, (x, y, 1.0)), Intrinsics.from_horizontal_fov(320, 240, 70.0))


@pytest.mark.parametrize("bystanders", [0, 3])
def test_no_shadow_falls_on_ground_that_is_taken_for_lit(bystanders):
    rng = np.random.default_rng(bystanders)
    told = 0
    for seed in range(60):
        scene = sample_scene(seed, "test", bystanders)
        light, points, camera = light_of(scene), crowd(scene, rng), camera_near(scene, rng)
        picture = Region.seen_by(camera.intrinsics)
        ground = shadowed_ground(points, patch_of(scene), light)
        region = region_of(ground, camera, picture)
        told += region != picture
        x, y, distance = project(shadows(points, light.towards_sun), camera).T
        shown = (distance > 0) & (x > -0.5) & (x < 319.5) & (y > -0.5) & (y < 239.5)
        if region is None:
            assert not shown.any()
            continue
        assert ((np.rint(x) >= region.left) & (np.rint(x) < region.right))[shown].all()
        assert ((np.rint(y) >= region.top) & (np.rint(y) < region.bottom))[shown].all()
    assert told > 30


def test_a_region_beside_the_shadow_shows_none_of_it():
    ground = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], float)
    camera = Camera(CameraPose((4.0, 0.0, 1.5), (0.0, 0.0, 0.5)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
    assert region_of(ground, camera, Region(0, 0, 640, 100)) is None
    within = region_of(ground, camera, Region(0, 100, 640, 380))
    assert within is not None
    assert within.width < 200
    assert within.is_within(Region(0, 100, 640, 380))


def test_ground_under_the_camera_is_looked_at_everywhere():
    ground = np.array([(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)], float)
    camera = Camera(CameraPose((4.0, 0.0, 1.5), (0.0, 0.0, 0.5)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
    assert region_of(ground, camera, Region(3, 4, 50, 60)) == Region(3, 4, 50, 60)


def test_where_the_map_of_shadows_does_not_hold_everybody_it_does_not_tell():
    scene = sample_scene(0, "test")
    beyond = np.array([(*scene.position, 1.0), (9.0, 0.0, 1.0)], np.float32)
    assert shadowed_ground([beyond], patch_of(scene), light_of(scene)) is None
    camera = camera_near(scene, np.random.default_rng(0))
    assert region_of(None, camera, Region(1, 2, 3, 4)) == Region(1, 2, 3, 4)
