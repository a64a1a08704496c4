import numpy as np
import pytest

from protocol.errors import InvalidInput
from render_worker.surroundings.surroundings import (
    BACKGROUNDS,
    GROUNDS,
    HALL_HALF_WIDTH,
    ground_bands,
    ground_patch,
    is_hall,
    make_ground,
    make_shells,
    require_names,
)


def area(corners: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (corners[triangles[:, k], :2] for k in range(3))
    u, v = b - a, c - a
    return float(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum() / 2)


@pytest.mark.parametrize("name", GROUNDS)
def test_every_ground_is_a_square_image_of_some_metres(assets, name):
    ground = make_ground(name, assets.photographs)
    assert ground.image.dtype == np.uint8
    assert ground.image.shape == (512, 512, 3)
    assert 1 < ground.extent < 10
    assert ground.image.std() > 1


@pytest.mark.parametrize("name", BACKGROUNDS)
def test_every_background_surrounds_the_drones_workspace(assets, name):
    for shell in make_shells(name, assets.photographs):
        assert np.abs(shell.corners[:, :2]).max() > 13
        assert shell.triangles.max() < len(shell.corners)
        assert shell.image.dtype == np.uint8


def test_the_walls_of_halls_stand_beyond_the_workspace():
    assert HALL_HALF_WIDTH > 13


def test_unknown_names_are_refused_with_those_that_are_known():
    with pytest.raises(InvalidInput, match=r"lava.*grass"):
        require_names("lava", BACKGROUNDS[0])
    with pytest.raises(InvalidInput, match=r"space.*sky-clear"):
        require_names(GROUNDS[0], "space")


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.4, -0.3)])
def test_the_ground_has_neither_hole_nor_overlap(centre):
    bands = ground_bands(centre, 3.2, 2.0, 1.0, hall=True)
    patch = ground_patch(centre, 3.2, 2.0)
    assert area(*bands) + area(*patch) == pytest.approx((2 * HALL_HALF_WIDTH) ** 2, rel=1e-5)


def test_ground_texture_runs_on_across_the_patchs_border():
    bands, _ = ground_bands((0.4, 0.1), 3.2, 2.0, 1.0, hall=False)
    patch, _ = ground_patch((0.4, 0.1), 3.2, 2.0)
    np.testing.assert_allclose(bands[:4, :5], patch, atol=1e-6)


def test_halls_are_told_from_skies():
    assert is_hall("hall-brick")
    assert not is_hall("sky-town")
