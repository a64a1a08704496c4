import numpy as np
import pytest

from render_worker.people.outfit import Fabric, Garment
from render_worker.people.person import dress, edges, is_feminine
from render_worker.scenes import sample_scene

SHIRT = Garment("tights", 0.5, 0.85, 0.6, 0.5, 0.01, Fabric("plain", (1, 2, 3), (4, 5, 6), 7))
TROUSERS = Garment("tights", 0.05, 0.6, 0.0, 0.0, 0.01, SHIRT.fabric)


def inside(garment: Garment, point: tuple[float, float, float], along_arm: float = 0.0) -> bool:
    return bool((edges(garment, np.array([point], np.float32), np.array([along_arm], np.float32)) > 0).all())


def test_a_shirt_covers_the_trunk_between_hem_and_neck():
    assert inside(SHIRT, (0.08, 0.0, 0.7))
    assert not inside(SHIRT, (0.08, 0.0, 0.45))
    assert not inside(SHIRT, (0.0, 0.0, 0.9))


def test_a_neckline_is_lower_in_front_than_behind():
    assert not inside(SHIRT, (0.06, 0.0, 0.83))
    assert inside(SHIRT, (-0.06, 0.0, 0.83))


def test_a_sleeve_ends_along_the_arm_whatever_its_height():
    assert inside(SHIRT, (0.0, 0.2, 0.6), along_arm=0.5)
    assert not inside(SHIRT, (0.0, 0.2, 0.6), along_arm=0.7)


def test_trousers_leave_a_hand_alone_that_hangs_beside_them():
    assert inside(TROUSERS, (0.0, 0.06, 0.4))
    assert not inside(TROUSERS, (0.0, 0.2, 0.5), along_arm=2.2)


@pytest.fixture(scope="module")
def person(assets):
    return dress(assets, sample_scene(3, "test").person)


def test_a_person_is_one_mesh_of_sound_triangles(person):
    count = len(person.corners)
    assert person.corners.shape == (count, 12)
    assert np.isfinite(person.corners).all()
    for triangles in (person.closed, person.open):
        assert triangles.min() >= 0
        assert triangles.max() < count
    assert person.corners[:, 8].max() < len(person.textures)


def test_no_edge_crosses_a_closed_triangle(person):
    assert (person.corners[person.closed, 9:] >= 0).all()


def test_skin_under_cloth_is_left_out(assets, person):
    skin = person.corners[person.closed][:, 0, 8] == 0
    assert skin.sum() < 0.75 * len(assets.parts["skin"].triangles)


def test_a_scene_dresses_the_same_twice(assets, person):
    again = dress(assets, sample_scene(3, "test").person)
    np.testing.assert_array_equal(person.corners, again.corners)
    for one, other in zip(person.textures, again.textures, strict=True):
        np.testing.assert_array_equal(one[0], other[0])


def test_identities_alternate_between_women_and_men(assets):
    assert is_feminine(assets, 0)
    assert not is_feminine(assets, 1)
