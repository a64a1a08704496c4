import numpy as np

from protocol.skeleton import Joint


def test_the_scalp_is_all_of_the_skin_that_reaches_above_where_hair_ends(assets):
    skin, scalp = assets.surfaces["skin"], assets.scalp
    lowest = assets.face[Joint.NOSE, 2] - 0.1
    reaching = (skin.points[skin.triangles][:, :, 2] > lowest).any(axis=1)
    np.testing.assert_array_equal(scalp.source[scalp.triangles], skin.source[skin.triangles[reaching]])
    np.testing.assert_array_equal(scalp.uv[scalp.triangles], skin.uv[skin.triangles[reaching]])
    assert len(scalp.source) < 0.5 * len(skin.source)


def test_columns_are_the_triangles(assets):
    for surface in (*assets.surfaces.values(), assets.scalp):
        np.testing.assert_array_equal(surface.columns.T, surface.triangles)
        assert surface.points.shape == (len(surface.source), 3)
