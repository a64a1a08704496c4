import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.networks.pixels import as_image, fitted, stretched


def coloured(rows, columns, colour):
    rgb = np.zeros((rows, columns, 3), np.uint8)
    rgb[:] = colour
    return rgb


class TestStretched:
    def test_shrinks_by_the_mean_of_all_pixels(self):
        rgb = np.zeros((480, 640, 3), np.uint8)
        rgb[0, 0] = 160
        assert stretched(rgb, (120, 160))[0, 0, 0] == 10

    def test_can_be_larger_than_the_picture(self):
        assert (stretched(coloured(40, 40, 77), (240, 320)) == 77).all()


class TestImage:
    @pytest.mark.parametrize(
        ("pixels", "expected"),
        [
            ("bgr", [255.0, 128.0, 0.0]),
            ("bgr_centred", [127 / 256, 0.0, -0.5]),
            ("rgb_unit", [0.0, 128 / 255, 1.0]),
            ("rgb_signed", [-1.0, 0.5 / 127.5, 1.0]),
            # By the means and deviations of ImageNet as torchvision has them.
            ("rgb_imagenet", [-0.485 / 0.229, (128 / 255 - 0.456) / 0.224, (1 - 0.406) / 0.225]),
        ],
    )
    def test_has_the_order_and_scale_that_the_network_takes(self, pixels, expected):
        image = as_image(coloured(16, 24, (0, 128, 255)), pixels)
        assert image.shape == (3, 16, 24)
        assert image.dtype == np.float32
        assert image.flags.c_contiguous
        assert pytest.approx(np.broadcast_to(expected, (16 * 24, 3)), abs=1e-5) == image.reshape(3, -1).T


class TestFitted:
    def test_keeps_a_wide_picture_s_shape_with_black_above_and_below(self):
        picture, placement = fitted(coloured(480, 640, 200), (256, 256), 4)
        assert picture.shape == (256, 256, 3)
        assert (picture[32:224] == 200).all()
        assert not picture[:32].any()
        assert not picture[224:].any()
        assert placement.cut(np.zeros((17, 64, 64), np.float32)).shape == (17, 48, 64)

    def test_tells_which_cells_show_the_picture(self):
        _, placement = fitted(coloured(480, 640, 200), (256, 256), 4)
        maps = np.arange(64 * 64, dtype=np.float32).reshape(1, 64, 64)
        assert placement.cut(maps)[0, 0, 0] == 8 * 64
        assert placement.cut(maps)[0, -1, -1] == 56 * 64 - 1

    @given(st.integers(1, 900), st.integers(1, 900))
    def test_covers_whole_cells_and_touches_two_sides(self, rows, columns):
        picture, placement = fitted(coloured(rows, columns, 255), (192, 192), 4)
        assert 48 in (placement.rows, placement.columns)
        lit = picture[..., 0] == 255
        assert lit.sum() == placement.rows * placement.columns * 16
        assert placement.cut(lit[None, ::4, ::4]).all()
