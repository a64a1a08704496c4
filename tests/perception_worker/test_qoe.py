import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.qoe import (
    distance_quality,
    quality_of_estimation,
)
from protocol.errors import InvalidInput
from protocol.skeleton import Joint
from tests.perception_worker import reference_qoe

CHAIN = [
    Joint.RIGHT_WRIST,
    Joint.RIGHT_ELBOW,
    Joint.RIGHT_SHOULDER,
    Joint.NECK,
    Joint.LEFT_SHOULDER,
    Joint.LEFT_ELBOW,
    Joint.LEFT_WRIST,
]
PLAUSIBLE = {"right_forearm": 0.3, "right_arm": 0.3, "right_collar": 0.2, "left_collar": 0.2, "left_arm": 0.3}
HALFWAY = 1.6875
"""Metres at which w_T is one half: T = 1.5, and 1.25 T = 1.875."""


def body(**lengths):
    """Joints on a line, wrist to wrist, with bones of the given lengths; the other joints at the neck."""
    bones = {**PLAUSIBLE, "left_forearm": 0.3, **lengths}
    order = ("right_forearm", "right_arm", "right_collar", "left_collar", "left_arm", "left_forearm")
    along = np.concatenate([[0.0], np.cumsum([bones[name] for name in order])])
    points = np.zeros((18, 3))
    points[CHAIN, 0] = along - along[3]
    return points


def without(points, *joints):
    points = points.copy()
    points[list(joints)] = np.nan
    return points


def only(positions):
    """Nothing located but the given joints."""
    points = np.full((18, 3), np.nan)
    for joint, position in positions.items():
        points[joint] = position
    return points


class TestGeneralRule:
    @pytest.mark.parametrize(
        ("metres", "quality"), [(0.0, 1.0), (1.5, 1.0), (HALFWAY, 0.5), (1.59375, 0.75), (1.875, 0.0), (9.0, 0.0)]
    )
    def test_falls_from_one_and_a_half_metres_to_a_quarter_more(self, metres, quality):
        points = only({Joint.RIGHT_HIP: (1, 2, 3), Joint.LEFT_ANKLE: (1 + metres, 2, 3)})
        assert distance_quality(points)[Joint.RIGHT_HIP] == pytest.approx(quality)

    def test_measures_from_the_mean_of_the_other_located_joints(self):
        # The mean of the two others is HALFWAY from the hip; with the hip in it, or divided by 17, it is nearer.
        points = only(
            {
                Joint.RIGHT_HIP: (0, 0, 0),
                Joint.LEFT_KNEE: (HALFWAY, 1, 0),
                Joint.RIGHT_KNEE: (HALFWAY, -1, 0),
            }
        )
        assert distance_quality(points)[Joint.RIGHT_HIP] == pytest.approx(0.5)

    def test_a_joint_alone_has_no_quality(self):
        for place in ((1, 2, 3), (0, 0, 0)):
            assert not distance_quality(only({Joint.NOSE: place})).any()

    def test_nobody_has_no_quality(self):
        assert not distance_quality(np.full((18, 3), np.nan)).any()


class TestChainRule:
    def test_a_human_body_is_plausible(self):
        assert (distance_quality(body()) == 1.0).all()

    def test_joints_that_are_not_located_have_no_quality(self):
        quality = distance_quality(without(body(), Joint.RIGHT_ELBOW, Joint.NOSE))
        assert quality[Joint.RIGHT_ELBOW] == quality[Joint.NOSE] == 0.0
        assert quality.sum() == 16.0

    @pytest.mark.parametrize(
        ("length", "quality"),
        [(np.nextafter(0.25, 0), 0.0), (0.25, 1.0), (0.60, 1.0), (np.nextafter(0.60, 1), 0.0)],
    )
    def test_the_range_of_a_bone_includes_its_ends(self, length, quality):
        # The forearm alone makes the elbow correct; a wrist without it falls under the general rule, far from the hips.
        points = only(
            {
                Joint.RIGHT_ELBOW: (0, 0, 0),
                Joint.RIGHT_WRIST: (length, 0, 0),
                Joint.RIGHT_HIP: (0, 0, 9),
                Joint.LEFT_HIP: (0, 0, 9),
            }
        )
        assert distance_quality(points)[Joint.RIGHT_WRIST] == quality

    def test_a_joint_with_one_plausible_bone_is_correct(self):
        quality = distance_quality(body(right_arm=0.1))
        assert quality[Joint.RIGHT_ELBOW] == quality[Joint.RIGHT_SHOULDER] == 1.0

    def test_an_elbow_with_a_bone_too_short_and_the_other_too_long_is_wrong(self):
        assert distance_quality(body(right_arm=0.1, right_forearm=0.7))[Joint.RIGHT_ELBOW] == 0.0

    def test_an_elbow_with_two_long_bones_is_judged_by_their_mean_excess(self):
        # Excesses of 1.6 and 1.775 m over 0.60: their mean is halfway.
        quality = distance_quality(body(right_forearm=2.2, right_arm=2.375))
        assert quality[Joint.RIGHT_ELBOW] == pytest.approx(0.5)

    def test_an_elbow_whose_bones_are_a_little_long_is_not_blamed(self):
        assert distance_quality(body(right_forearm=0.7, right_arm=0.7))[Joint.RIGHT_ELBOW] == 1.0

    def test_a_shoulder_measures_its_two_bones_by_ranges_of_their_own(self):
        # Excesses of 1.6 over 0.60 (arm) and 1.775 over 0.45 (collarbone).
        quality = distance_quality(body(left_arm=2.2, left_collar=2.225))
        assert quality[Joint.LEFT_SHOULDER] == pytest.approx(0.5)

    def test_the_neck_is_correct_by_one_collarbone(self):
        assert distance_quality(body(left_collar=0.1))[Joint.NECK] == 1.0

    def test_the_neck_is_wrong_with_two_short_collarbones(self):
        assert distance_quality(body(left_collar=0.1, right_collar=0.1))[Joint.NECK] == 0.0

    def test_a_bone_that_cant_be_measured_leaves_the_judgement_to_the_other(self):
        short = without(body(right_arm=0.1), Joint.RIGHT_WRIST)
        assert distance_quality(short)[Joint.RIGHT_ELBOW] == 0.0
        long = without(body(right_arm=0.60 + HALFWAY), Joint.RIGHT_WRIST)
        assert distance_quality(long)[Joint.RIGHT_ELBOW] == pytest.approx(0.5)

    def test_a_joint_with_no_measured_bone_falls_under_the_general_rule(self):
        points = only({Joint.RIGHT_ELBOW: (0, 0, 0), Joint.LEFT_HIP: (HALFWAY, 0, 0)})
        assert distance_quality(points)[Joint.RIGHT_ELBOW] == pytest.approx(0.5)


BONES = ("right_forearm", "right_arm", "right_collar", "left_collar", "left_arm", "left_forearm")
"""Of `body`, in the chain's order."""

LONGEST = {bone: 0.45 if "collar" in bone else 0.60 for bone in BONES}


@pytest.mark.parametrize("place", range(1, 6))
class TestJointBetweenTwoBones:
    """The rules of elbows, shoulders and neck, each at every one of them."""

    def test_is_correct_by_either_bone_alone(self, place):
        for one, other in ((BONES[place - 1], BONES[place]), (BONES[place], BONES[place - 1])):
            for wrong in (0.1, LONGEST[one] + 3.0):
                assert distance_quality(body(**{one: wrong, other: 0.3}))[CHAIN[place]] == 1.0

    def test_is_wrong_with_both_bones_too_short(self, place):
        assert distance_quality(body(**{BONES[place - 1]: 0.1, BONES[place]: 0.1}))[CHAIN[place]] == 0.0

    def test_is_wrong_with_one_bone_too_short_and_the_other_too_long(self, place):
        for short, long in ((BONES[place - 1], BONES[place]), (BONES[place], BONES[place - 1])):
            assert distance_quality(body(**{short: 0.1, long: LONGEST[long] + 0.1}))[CHAIN[place]] == 0.0

    def test_is_judged_by_the_mean_excess_of_two_long_bones(self, place):
        # Excesses of 1.6 and 1.775 m: their mean is halfway.
        one, other = BONES[place - 1], BONES[place]
        quality = distance_quality(body(**{one: LONGEST[one] + 1.6, other: LONGEST[other] + 1.775}))
        assert quality[CHAIN[place]] == pytest.approx(0.5)

    def test_is_judged_by_one_bone_where_the_other_can_not_be_measured(self, place):
        for bone, missing in ((BONES[place - 1], CHAIN[place + 1]), (BONES[place], CHAIN[place - 1])):
            for length, quality in ((0.3, 1.0), (0.1, 0.0), (LONGEST[bone] + HALFWAY, 0.5)):
                points = without(body(**{bone: length}), missing)
                assert distance_quality(points)[CHAIN[place]] == pytest.approx(quality)

    def test_falls_under_the_general_rule_where_neither_can_be_measured(self, place):
        points = only({CHAIN[place]: (0, 0, 0), Joint.LEFT_ANKLE: (HALFWAY, 0, 0)})
        assert distance_quality(points)[CHAIN[place]] == pytest.approx(0.5)


class TestWrist:
    def test_is_correct_with_a_correct_elbow_and_a_plausible_forearm(self):
        assert distance_quality(body(left_arm=0.1))[Joint.LEFT_WRIST] == 1.0

    def test_with_a_correct_elbow_and_a_short_forearm_is_wrong(self):
        assert distance_quality(body(left_forearm=0.1))[Joint.LEFT_WRIST] == 0.0

    def test_with_a_correct_elbow_and_a_long_forearm_is_judged_by_its_excess(self):
        quality = distance_quality(body(left_forearm=0.60 + HALFWAY))
        assert quality[Joint.LEFT_WRIST] == pytest.approx(0.5)
        assert quality[Joint.LEFT_ELBOW] == 1.0

    def test_with_an_incorrect_elbow_falls_under_the_general_rule(self):
        # The bone rule would give the wrist 0, its forearm being too short; the general rule finds it near the rest.
        quality = distance_quality(body(left_forearm=0.1, left_arm=0.7))
        assert quality[Joint.LEFT_ELBOW] == 0.0
        assert quality[Joint.LEFT_WRIST] == 1.0

    def test_with_an_elbow_that_is_not_located_falls_under_the_general_rule(self):
        points = only({Joint.LEFT_WRIST: (0, 0, 0), Joint.NOSE: (HALFWAY, 0, 0)})
        assert distance_quality(points)[Joint.LEFT_WRIST] == pytest.approx(0.5)


@st.composite
def skeletons(draw):
    """Bodies with bones of every kind: too short, plausible, somewhat and far too long; some joints missing."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    lengths = [rng.uniform(*draw(st.sampled_from([(0, 0.2), (0.2, 0.6), (0.5, 2), (1.8, 3)]))) for _ in range(6)]
    points = rng.normal(0, draw(st.sampled_from([0.3, 1.0])), (18, 3))
    for start, end, length in zip(CHAIN[:-1], CHAIN[1:], lengths, strict=True):
        direction = rng.normal(size=3)
        points[end] = points[start] + length * direction / np.linalg.norm(direction)
    return without(points, *draw(st.sets(st.sampled_from(list(Joint)), max_size=12)))


class TestDistanceProperties:
    @given(skeletons())
    def test_agrees_with_the_reference(self, points):
        assert distance_quality(points) == pytest.approx(reference_qoe.distance(points))

    @given(skeletons())
    def test_lies_between_zero_and_one_and_is_zero_where_not_located(self, points):
        quality = distance_quality(points)
        assert ((quality >= 0) & (quality <= 1)).all()
        assert not quality[np.isnan(points[:, 0])].any()

    @given(skeletons(), st.floats(0, 6.28))
    def test_does_not_depend_on_where_the_person_stands_and_looks(self, points, yaw):
        turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        assert distance_quality(points @ turn.T + (3, -2, 1)) == pytest.approx(distance_quality(points), abs=1e-9)

    @given(skeletons())
    def test_treats_left_and_right_alike(self, points):
        mirror = [0, 1, 5, 6, 7, 2, 3, 4, 11, 12, 13, 8, 9, 10, 15, 14, 17, 16]
        assert distance_quality(points[mirror]) == pytest.approx(distance_quality(points)[mirror])

    def test_lists_are_taken_and_other_shapes_refused(self):
        assert (distance_quality(body().tolist()) == 1.0).all()
        with pytest.raises(InvalidInput, match="shape"):
            distance_quality(np.zeros((17, 3)))


class TestCombined:
    def heatmaps(self):
        """Every joint's map has a peak of 0.8 at (1, 2) and one of 0.2 at (4, 4)."""
        heatmaps = np.zeros((19, 6, 8), np.float32)
        heatmaps[:, 1, 2], heatmaps[:, 4, 4] = 0.8, 0.2
        return heatmaps

    def test_is_the_mean_of_the_three(self):
        quality = quality_of_estimation(self.heatmaps(), np.tile([1, 2], (18, 1)), body(right_forearm=0.1))
        assert quality.mass == pytest.approx(np.full(18, 0.8))
        assert quality.height == pytest.approx(np.full(18, 0.8))
        assert quality.combined[Joint.NOSE] == pytest.approx((0.8 + 0.8 + 1) / 3)
        assert quality.combined[Joint.RIGHT_WRIST] == pytest.approx((0.8 + 0.8 + 0) / 3)

    def test_a_joint_that_was_not_detected_has_all_four_at_zero(self):
        cells = np.tile([1, 2], (18, 1))
        cells[Joint.NOSE] = -1
        quality = quality_of_estimation(self.heatmaps(), cells, body())
        for component in (quality.mass, quality.height, quality.distance, quality.combined):
            assert component[Joint.NOSE] == 0.0
            assert (np.delete(component, Joint.NOSE) > 0).all()

    def test_a_joint_that_was_seen_and_not_located_keeps_mass_and_height(self):
        cells = np.tile([1, 2], (18, 1))
        quality = quality_of_estimation(self.heatmaps(), cells, without(body(), Joint.NOSE))
        assert quality.distance[Joint.NOSE] == 0.0
        assert quality.combined[Joint.NOSE] == pytest.approx((0.8 + 0.8 + 0) / 3)
