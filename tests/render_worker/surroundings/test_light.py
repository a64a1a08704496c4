import math

import msgspec
import numpy as np
import pytest

from protocol.scene import Sun
from render_worker.scenes import sample_scene
from render_worker.surroundings.light import light_of, light_view


def test_the_sun_shines_from_where_the_scene_says():
    scene = msgspec.structs.replace(sample_scene(1, "test"), sun=Sun(azimuth=math.pi / 2, elevation=math.pi / 6))
    np.testing.assert_allclose(light_of(scene).towards_sun, (0, math.cos(math.pi / 6), 0.5), atol=1e-12)


def test_the_suns_view_is_centred_on_the_person_and_nearer_is_less_deep():
    towards = (0.0, 0.6, 0.8)
    view = light_view(towards, (1.0, 2.0, 0.9))
    np.testing.assert_allclose((view @ (1, 2, 0.9, 1))[:3], 0, atol=1e-12)
    nearer = view @ (1, 2 + 0.6, 0.9 + 0.8, 1)
    assert nearer[2] < 0
    np.testing.assert_allclose(nearer[:2], 0, atol=1e-12)


def test_the_view_holds_head_feet_and_hands():
    view = light_view((math.cos(0.7), 0.0, math.sin(0.7)), (0.0, 0.0, 0.95))
    for point in ((0, 0, 1.9), (0, 0, 0), (0, 0.8, 1.4), (0.8, 0, 1.3)):
        assert np.abs((view @ (*point, 1))[:3]).max() < 1


def test_a_sun_overhead_still_has_a_view():
    assert np.isfinite(light_view((0.0, 0.0, 1.0), (0, 0, 1))).all()


def test_the_ground_is_darker_in_the_shadow():
    for seed in range(20):
        light = light_of(sample_scene(seed, "test"))
        assert light.shadow_shade < 0.85 * light.lit_shade
        assert pytest.approx(1) == np.linalg.norm(light.towards_sun)


def test_a_person_alone_is_the_middle_of_the_light():
    scene = sample_scene(1, "test")
    light = light_of(scene)
    assert (light.centre, light.reach) == (scene.position, 3.2)
    np.testing.assert_array_equal(light.view, light_view(light.towards_sun, (*scene.position, 0.95)))


def test_the_suns_view_holds_every_bystander_and_their_shadows_have_ground_to_fall_on():
    for seed in range(10):
        scene = sample_scene(seed, "test", 3)
        light = light_of(scene)
        for x, y in (scene.position, *(one.position for one in scene.bystanders)):
            assert math.dist((x, y), light.centre) + 3.2 <= light.reach + 1e-9
            for height in (0.0, 1.9):
                assert np.abs((light.view @ (x, y, height, 1))[:3]).max() < 1


def test_a_bystander_out_of_sight_does_not_widen_the_ground_beyond_what_there_is():
    scene = sample_scene(1, "test", 1)
    far = msgspec.structs.replace(scene.bystanders[0], position=(500.0, 0.0))
    assert light_of(msgspec.structs.replace(scene, bystanders=(far,))).reach < 9
