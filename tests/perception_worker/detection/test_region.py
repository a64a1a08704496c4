"""The region that shows a person large."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from perception_worker.detection.region import around_person, at_inner_edge
from protocol.region import Region

WHOLE = Region.whole(480, 640)
SQUARE = 1.0


@st.composite
def people(draw):
    """Joints (n, 2) of somebody of any size, in a picture or half out of it."""
    middle = np.array([draw(st.floats(-50, 700)), draw(st.floats(-50, 700))])
    offsets = st.tuples(st.floats(-1, 1), st.floats(-1, 1))
    return middle + draw(st.floats(1, 150)) * np.array(draw(st.lists(offsets, min_size=1, max_size=18)))


areas = st.sampled_from([WHOLE, Region.whole(640, 480), Region.whole(3000, 200), Region(100, 50, 400, 300)])
aspects = st.sampled_from([1.0, 4 / 3, 0.5])


class TestAroundPerson:
    @given(people(), areas, aspects, st.floats(0, 100))
    def test_lies_in_the_picture_and_holds_all_that_is_in_it(self, found, area, aspect, reach):
        region = around_person(np.vstack([found, (np.nan, np.nan)]), area, aspect, reach)
        assume(region is not None)
        assert region.is_within(area)
        box = np.array([np.min(found, axis=0), np.max(found, axis=0)])
        low = np.maximum(box[0], (area.left, area.top))
        high = np.minimum(box[1], (area.right - 1, area.bottom - 1))
        assert (low >= np.array([region.left, region.top]) - 1).all()
        assert (high <= np.array([region.right, region.bottom])).all()

    @given(people(), areas, aspects)
    def test_has_the_shape_that_the_network_sees(self, found, area, aspect):
        region = around_person(found, area, aspect)
        assume(region is not None)
        assert region.width == pytest.approx(region.height * aspect, abs=1 + aspect / 2)

    def test_leaves_a_margin_around_the_person(self):
        # 200 pixels upright and 50 sideways: a margin of 36 pixels, and then as wide as the network's shape asks. The
        # middle of rows 100 to 300 is row 200, and 272 rows around it begin at row 64.
        region = around_person(np.array([[300.0, 100.0], [350.0, 300.0]]), WHOLE, SQUARE)
        assert region == Region(left=190, top=64, width=272, height=272)

    def test_is_wider_by_what_the_joints_may_be_off(self):
        joints = np.array([[300.0, 100.0], [350.0, 300.0]])
        assert around_person(joints, WHOLE, SQUARE, reach=25.0) == Region(left=164, top=40, width=322, height=322)

    def test_of_somebody_far_away_is_large_enough_to_see_something(self):
        assert around_person(np.array([[300.0, 200.0]]), WHOLE, SQUARE) == Region(252, 152, 96, 96)

    def test_is_as_high_as_the_picture_where_the_person_is(self):
        assert around_person(np.array([[300.0, 5.0], [350.0, 475.0]]), WHOLE, SQUARE) == Region(86, 0, 480, 480)

    @pytest.mark.parametrize(
        ("joints", "area"),
        [
            pytest.param([[10.0, 5.0], [600.0, 470.0]], WHOLE, id="wider than any square in the picture"),
            pytest.param([[10.0, 5.0], [400.0, 470.0]], Region.whole(480, 500), id="most of the picture"),
            pytest.param([[700.0, 100.0], [800.0, 300.0]], WHOLE, id="nothing of the person in the picture"),
            pytest.param([[30.0, 30.0]], Region.whole(64, 64), id="a picture smaller than any region"),
        ],
    )
    def test_is_none_where_the_whole_picture_is_to_be_looked_at(self, joints, area):
        assert around_person(np.array(joints), area, SQUARE) is None

    def test_of_a_person_half_out_of_the_picture_is_around_the_half_that_is_in_it(self):
        # The margin is that of a whole person, 300 pixels high: 54 pixels.
        region = around_person(np.array([[600.0, 100.0], [700.0, 400.0]]), WHOLE, SQUARE)
        assert region == Region(left=640 - 408, top=46, width=408, height=408)


class TestInnerEdge:
    REGION = Region(100, 0, 200, 200)

    @pytest.mark.parametrize("joint", [(104.0, 100.0), (295.0, 100.0), (200.0, 195.0)])
    def test_a_joint_in_the_outermost_cell_is_at_the_edge(self, joint):
        assert at_inner_edge(np.array([joint, (np.nan, np.nan)]), self.REGION, WHOLE, cell=8.0)

    def test_the_picture_s_own_edge_is_none(self):
        assert not at_inner_edge(np.array([(200.0, 2.0), (200.0, 100.0)]), self.REGION, WHOLE, cell=8.0)

    def test_nobody_is_at_no_edge(self):
        assert not at_inner_edge(np.full((18, 2), np.nan), self.REGION, WHOLE, cell=8.0)
