import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.qoe import heatmap_cell
from perception_worker.region import Region, around_person

WHOLE = Region.whole(480, 640)


def sides(largest):
    return st.integers(8, largest)


@st.composite
def regions(draw):
    width, height = draw(sides(640)), draw(sides(480))
    return Region(draw(st.integers(0, 640 - width)), draw(st.integers(0, 480 - height)), width, height)


class TestPixels:
    def test_a_cell_s_centre_is_the_centre_of_the_pixels_that_it_covers(self):
        # Cell 0 of 40 covers the pixels 0 to 15 of 640, whose centre is at 7.5; cell (39, 29) ends at (639, 479).
        pixels = WHOLE.pixels(np.array([[0.0, 0.0], [39.0, 29.0], [0.5, 1.0]]), (30, 40))
        assert pixels == pytest.approx(np.array([[7.5, 7.5], [631.5, 471.5], [15.5, 23.5]]))

    def test_of_a_crop_are_moved_and_scaled_with_it(self):
        # 4 pixels to a cell: the first covers columns 100 to 103.
        pixels = Region(100, 50, 160, 120).pixels(np.array([[0.0, 0.0]]), (30, 40))
        assert pixels == pytest.approx(np.array([[101.5, 51.5]]))

    @given(regions(), st.integers(0, 29), st.integers(0, 39))
    def test_of_a_cell_s_centre_fall_back_into_the_cell(self, region, row, column):
        pixel = region.inside(region.pixels(np.array([[column, row]], float), (30, 40)))[0]
        # Where a cell is smaller than a pixel, its centre may belong to the pixel before.
        if region.width > 40 and region.height > 30:
            assert heatmap_cell(pixel, (region.height, region.width), (30, 40)) == (row, column)

    def test_that_are_nowhere_stay_nowhere(self):
        assert np.isnan(WHOLE.pixels(np.full((2, 2), np.nan), (30, 40))).all()


def test_a_part_of_a_picture_is_what_the_region_shows():
    rgb = np.zeros((480, 640, 3), np.uint8)
    rgb[100:148, 200:264] = 10, 20, 30
    part = Region(200, 100, 64, 48).part(rgb)
    assert part.shape == (48, 64, 3)
    assert (part == (10, 20, 30)).all()


class TestAroundPerson:
    @given(st.lists(st.tuples(st.floats(0, 639), st.floats(0, 479)), min_size=1, max_size=18))
    def test_holds_every_joint_and_lies_inside_the_frame(self, found):
        keypoints = np.array([*found, (np.nan, np.nan)])
        region = around_person(keypoints, WHOLE, aspect=4 / 3)
        assert region.left >= 0
        assert region.top >= 0
        assert region.left + region.width <= 640
        assert region.top + region.height <= 480
        inside = region.inside(np.array(found))
        assert (inside >= -0.5).all()
        assert (inside <= (region.width - 0.5, region.height - 0.5)).all()

    @given(st.lists(st.tuples(st.floats(0, 639), st.floats(0, 479)), min_size=1, max_size=18))
    def test_has_the_shape_that_the_network_sees(self, found):
        region = around_person(np.array(found), WHOLE, aspect=4 / 3)
        assert region.width / region.height == pytest.approx(4 / 3, abs=0.02)

    def test_leaves_a_margin_around_the_person(self):
        # 200 pixels upright and 50 sideways: a margin of 36 pixels, and then as wide as the network's shape asks.
        region = around_person(np.array([[300.0, 100.0], [350.0, 300.0]]), WHOLE, aspect=1.0)
        assert (region.height, region.width) == (272, 272)
        assert (region.left, region.top) == (189, 64)

    def test_is_all_of_a_frame_that_the_person_fills(self):
        assert around_person(np.array([[10.0, 5.0], [600.0, 470.0]]), WHOLE, aspect=4 / 3) == WHOLE

    def test_fits_into_a_frame_of_another_shape(self):
        frame = Region.whole(480, 100)
        assert around_person(np.array([[10.0, 5.0], [90.0, 470.0]]), frame, aspect=4 / 3) == frame
