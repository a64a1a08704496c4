import math

import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from render_worker.opengl.nearest import nearest_surface
from render_worker.opengl.outline import Outline
from render_worker.opengl.picture import NEAREST
from render_worker.people.person import dress
from render_worker.people.placing import place_person
from render_worker.scenes import sample_scene
from render_worker.surroundings.surroundings import is_hall

INTRINSICS = Intrinsics.from_horizontal_fov(64, 48, 90.0)
LEVEL = Camera(CameraPose((0.0, 0.0, 2.0), (1.0, 0.0, 2.0)), INTRINSICS)


def test_the_ground_by_hand():
    # The lowest rays fall by 24 rows of 32: 0.75 m a metre, so that 2 m of height are 2.67 m away.
    assert nearest_surface([], LEVEL, hall=False) == pytest.approx(2 / 0.75, rel=2e-3)


def test_somebody_in_the_picture_is_nearer_than_the_ground_and_behind_the_camera_they_do_not_count():
    before, behind = (Outline(np.array([(x, -1, 0), (x + 1, 1, 2)], np.float32)) for x in (1.5, -4.0))
    assert nearest_surface([before, behind], LEVEL, hall=False) == pytest.approx(1.5, rel=2e-3)
    assert nearest_surface([behind], LEVEL, hall=False) == nearest_surface([], LEVEL, hall=False)


def test_a_wall_counts_in_a_hall_alone():
    camera = Camera(CameraPose((13.0, 0.0, 2.0), (14.0, 0.0, 2.0)), INTRINSICS)
    assert nearest_surface([], camera, hall=True) == pytest.approx(1.0, rel=2e-3)
    assert nearest_surface([], camera, hall=False) > 2


@pytest.mark.parametrize("position", [(0.0, 0.0, -1.0), (20.0, 0.0, 1.0), (0.0, 0.0, 6.0)])
def test_outside_of_a_hall_anything_may_be_near(position):
    camera = Camera(CameraPose(position, (1.0, 1.0, 1.0)), INTRINSICS)
    assert nearest_surface([], camera, hall=True) == NEAREST


@pytest.mark.slow
def test_nothing_that_is_drawn_is_nearer(assets, renderer):
    rng = np.random.default_rng(0)
    for seed in range(5):
        scene = sample_scene(seed, "test", seed % 2)
        figures = (scene.person, *scene.bystanders)
        outlines = [Outline(place_person(dress(assets, one), one).corners[:, :3]) for one in figures]
        for distance in (0.4, 0.8, 1.5, 4.0):
            azimuth, altitude = rng.uniform((-math.pi, 0.2), (math.pi, 3.0)).tolist()
            eye = (distance * math.cos(azimuth), distance * math.sin(azimuth), altitude)
            camera = Camera(CameraPose(eye, (0.0, 0.0, 1.0)), INTRINSICS)
            depth = renderer.render(scene, camera).depth
            assert depth[depth > 0].min() >= nearest_surface(outlines, camera, hall=is_hall(scene.background))
