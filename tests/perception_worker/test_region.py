import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.region import around_person
from protocol.region import Region

WHOLE = Region.whole(480, 640)


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
