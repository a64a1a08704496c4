"""Whom a filter expects in a picture, and who of those that are there is the one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from perception_worker.detection.expectation import expected_at, expected_by, supposed_by
from perception_worker.networks.network import People
from protocol.camera import project
from protocol.pose_estimate import FilterState
from protocol.region import Region
from protocol.skeleton import Joint
from tests.perception_worker.detection.people import body, camera, knows
from tests.protocol.values.strategies import filter_state

CAMERA = camera()
AREA = Region.whole(480, 640)
SOMEBODY = knows(body())


def pixels_of(joints):
    return project(joints, CAMERA)[:, :2]


def choose(expectation, *people):
    """Whom an expectation takes out of people who are given in pixels: which one, and how many others are left."""
    chosen = expectation.choose(People(people[0], np.array(people[1:]).reshape(-1, 18, 2)), np.array(people))
    if np.isnan(chosen.person).all():
        return None, len(chosen.others)
    [own] = [index for index, one in enumerate(people) if np.array_equal(one, chosen.person, equal_nan=True)]
    return own, len(chosen.others)


class TestWhoIsKnown:
    def test_nobody_to_a_new_filter(self):
        assert expected_by(FilterState.initial(), CAMERA) is None

    def test_nobody_to_a_filter_that_has_seen_two_joints(self):
        joints = np.full((18, 3), np.nan)
        joints[:2] = body()[:2]
        assert expected_by(knows(joints), CAMERA) is None

    def test_nobody_any_more_to_a_filter_that_is_as_unsure_as_a_new_one(self):
        assert expected_by(knows(body(), deviation=1.1), CAMERA) is None

    def test_somebody_where_the_joints_project_to(self):
        expected = expected_by(SOMEBODY, CAMERA)
        assert expected.pixels == pytest.approx(pixels_of(body()))
        # At 4 m and a focal length of 457 pixels a metre is 114.25 pixels, and half of the deviation is 5 cm.
        assert expected.reach == pytest.approx(5.712, abs=0.01)

    def test_not_by_a_joint_that_is_no_part_of_the_body(self):
        joints = body()
        joints[Joint.LEFT_WRIST] += (-5.0, 0.0, 0.0)
        expected = expected_by(knows(joints), CAMERA)
        assert np.isnan(expected.pixels[Joint.LEFT_WRIST]).all()
        assert np.isfinite(np.delete(expected.pixels, Joint.LEFT_WRIST, axis=0)).all()

    def test_somebody_behind_the_camera_is_nowhere_in_the_picture(self):
        expected = expected_by(knows(body(x=8.0)), CAMERA)
        assert np.isnan(expected.pixels).all()
        assert expected.region(AREA, 1.0) is None
        assert choose(expected, pixels_of(body())) == (None, 1)

    def test_a_camera_inside_the_person_has_no_region_to_look_at(self):
        inside = camera(position=(0.05, 0.0, 1.2), target=(-1.0, 0.0, 1.2))
        assert expected_by(SOMEBODY, inside).region(AREA, 1.0) is None

    @given(filter_state, st.sampled_from([CAMERA, camera((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), size=(17, 9))]))
    def test_any_filter_gives_a_region_in_the_picture_or_none(self, state, taken_by):
        area = Region.seen_by(taken_by.intrinsics)
        expected = expected_by(replace(state, seen=np.ones(18, bool)), taken_by)
        region = expected and expected.region(area, 1.0)
        assert region is None or region.is_within(area)


class TestWhoIsSupposed:
    """By a filter that knows nobody."""

    BEGINS = FilterState.initial((0.0, 0.0, 1.2))

    def test_is_at_the_filter_s_means_give_or_take_its_deviation(self):
        region = supposed_by(self.BEGINS, CAMERA).region(AREA, 1.0)
        # A deviation of √1.01 m is 115 pixels at 4 m, and the least margin another 12.
        assert region.width == region.height == pytest.approx(2 * (115 + 12), abs=2)
        middle = pixels_of(np.array([[0.0, 0.0, 1.2]]))[0]
        assert (region.left + region.width / 2, region.top + region.height / 2) == pytest.approx(middle, abs=1)

    def test_may_be_anywhere_in_the_picture_where_the_filter_tells_of_nothing_that_is_in_it(self):
        for elsewhere in ((8.0, 0.0, 1.2), (0.0, 9.0, 1.2)):
            assert supposed_by(FilterState.initial(elsewhere), CAMERA).region(AREA, 1.0) is None

    def test_is_whoever_is_nearest_and_nobody_too_far_away_for_the_filter_s_deviation(self):
        supposed = supposed_by(self.BEGINS, CAMERA)
        assert choose(supposed, pixels_of(body(y=1.0)), pixels_of(body(y=0.2))) == (1, 1)
        assert choose(supposed, pixels_of(body(y=2.0))) == (None, 1)

    def test_beside_the_camera_however_close_to_its_plane_is_nowhere_in_the_picture(self):
        taken_by = camera((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
        assert supposed_by(FilterState.initial((1e-310, 1.0, 0.0)), taken_by).region(AREA, 1.0) is None

    @given(filter_state, st.sampled_from([CAMERA, camera((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), size=(17, 9))]))
    def test_of_any_filter_has_a_region_in_the_picture_or_none(self, state, taken_by):
        area = Region.seen_by(taken_by.intrinsics)
        region = supposed_by(state, taken_by).region(area, 0.7)
        assert region is None or region.is_within(area)


class TestRegion:
    def test_is_around_the_person(self):
        region = expected_by(SOMEBODY, CAMERA).region(AREA, 1.0)
        x, y = pixels_of(body()).T
        assert region.left < x.min() < x.max() < region.right
        assert region.top < y.min() < y.max() < region.bottom

    def test_grows_with_what_the_filter_does_not_know(self):
        sides = [expected_by(knows(body(), deviation=one), CAMERA).region(AREA, 1.0).width for one in (0.05, 0.3, 0.6)]
        assert sides[0] < sides[1] < sides[2]

    def test_is_the_same_for_the_same_request(self):
        one, other = (expected_by(knows(body()), camera()).region(AREA, 1.0) for _ in range(2))
        assert one == other


class TestSamePerson:
    EXPECTED = expected_by(SOMEBODY, CAMERA)

    def test_is_not_whoever_shows_the_most_joints(self):
        own = pixels_of(body())
        own[Joint.RIGHT_KNEE :] = np.nan
        assert choose(self.EXPECTED, pixels_of(body(y=1.2)), own) == (1, 1)

    def test_is_the_nearer_of_two_within_the_gate(self):
        assert choose(self.EXPECTED, pixels_of(body(y=0.3)), pixels_of(body(y=0.05))) == (1, 1)

    def test_is_not_a_fragment_that_lies_nearer_by_chance(self):
        fragment = np.full((18, 2), np.nan)
        fragment[:2] = pixels_of(body())[:2]
        assert choose(self.EXPECTED, fragment, pixels_of(body(y=0.1))) == (1, 1)

    def test_is_nobody_where_all_are_beyond_the_gate(self):
        assert choose(self.EXPECTED, pixels_of(body(y=1.2)), pixels_of(body(y=-1.5))) == (None, 2)

    def test_is_nobody_where_nobody_is(self):
        assert choose(self.EXPECTED, np.full((18, 2), np.nan)) == (None, 0)

    def test_may_be_farther_off_the_less_the_filter_knows(self):
        aside = pixels_of(body(y=0.7))
        assert choose(self.EXPECTED, aside) == (None, 1)
        assert choose(expected_by(knows(body(), deviation=0.5), CAMERA), aside) == (0, 0)

    def test_is_told_by_the_joints_that_both_have(self):
        upper = body()
        upper[[Joint.RIGHT_KNEE, Joint.RIGHT_ANKLE, Joint.LEFT_KNEE, Joint.LEFT_ANKLE]] = np.nan
        seen = pixels_of(body())
        seen[[Joint.NOSE, Joint.NECK]] = np.nan
        assert choose(expected_by(knows(upper), CAMERA), seen) == (0, 0)

    def test_in_a_closer_look_is_who_was_found_by_the_look_before(self):
        found = expected_at(pixels_of(body()), cell=16.0)
        assert choose(found, pixels_of(body(y=1.0)), pixels_of(body(y=0.05))) == (1, 1)
        assert choose(found, pixels_of(body(y=1.0))) == (None, 1)
