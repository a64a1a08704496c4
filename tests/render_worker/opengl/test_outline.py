import math

import numpy as np

from protocol.camera import Camera, CameraPose, Intrinsics, project, world_to_camera
from protocol.region import Region
from render_worker.opengl.outline import Outline
from render_worker.opengl.picture import clip_projection

INTRINSICS = Intrinsics.from_horizontal_fov(320, 240, 70.0)


def clip_of(pose: CameraPose) -> np.ndarray:
    return clip_projection(INTRINSICS) @ world_to_camera(pose)


def test_whoever_has_a_point_in_the_region_may_show():
    rng = np.random.default_rng(0)
    hidden = 0
    for _ in range(500):
        points = (rng.uniform(-2, 2, 3) + rng.uniform(-0.5, 0.5, (40, 3))).astype(np.float32)
        azimuth, distance = rng.uniform(-math.pi, math.pi), rng.uniform(0.2, 6)
        pose = CameraPose((distance * math.cos(azimuth), distance * math.sin(azimuth), 1.5), (0.0, 0.0, 1.0))
        left, top = int(rng.integers(300)), int(rng.integers(220))
        region = Region(left, top, int(rng.integers(1, 321 - left)), int(rng.integers(1, 241 - top)))
        x, y, depth = project(points.astype(float), Camera(pose, INTRINSICS)).T
        x, y = x[depth > 0.1], y[depth > 0.1]
        inside = (x > region.left - 0.5) & (x < region.right - 0.5) & (y > region.top - 0.5) & (y < region.bottom - 0.5)
        may_show = Outline(points).may_show(clip_of(pose), INTRINSICS, region)
        assert may_show or not inside.any()
        hidden += not may_show
    assert hidden > 100


def test_whoever_is_behind_the_camera_does_not_show():
    points = np.array([(5, -1, 0), (6, 1, 2)], np.float32)
    assert not Outline(points).may_show(
        clip_of(CameraPose((4.0, 0.0, 1.0), (0.0, 0.0, 1.0))), INTRINSICS, Region(0, 0, 320, 240)
    )
