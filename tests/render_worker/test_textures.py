from itertools import pairwise

import numpy as np

from render_worker.people.outfit import Fabric
from render_worker.textures import SIZE, eye_texture, fabric_texture, spots_of

CHECKED = Fabric("checks", (226, 224, 218), (44, 46, 50), 3)


def test_each_level_is_half_as_large_down_to_one_pixel():
    for levels in (fabric_texture(CHECKED), eye_texture((70, 46, 28))):
        assert [level.shape for level in levels] == [(SIZE >> k, SIZE >> k, 4) for k in range(10)]
        assert all((level[..., 3] == 255).all() for level in levels)


def test_a_pixel_is_the_mean_of_a_pair_of_pairs_rounded_up():
    levels = fabric_texture(CHECKED)
    for larger, smaller in pairwise(levels):
        pairs = (larger[:, 0::2].astype(int) + larger[:, 1::2] + 1) // 2
        np.testing.assert_array_equal(smaller, (pairs[0::2] + pairs[1::2] + 1) // 2)


def test_a_spot_has_all_of_a_mask_that_is_not_0():
    mask = np.zeros((4, 4), np.uint8)
    mask[1, 2], mask[3, 0] = 255, 51
    spot = spots_of({"lips": mask})["lips"]
    assert spot.places.tolist() == [6, 12]
    np.testing.assert_allclose(spot.strength, [1.0, 0.2])
