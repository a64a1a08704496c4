import itertools

import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.detection import WholeFrameDetector
from perception_worker.networks.backend import open_network
from perception_worker.perceive import Perceiver
from protocol.config import PerceptionConfig
from protocol.pose_estimate import FilterState
from protocol.skeleton import Joint
from tests.perception_worker.drawn_maps import DrawnNetwork, person
from tests.perception_worker.lifter.bodies import lifter

BLACK = np.zeros((480, 640, 3), np.uint8)
STANDING = person(20, 14)


def perceive(network, frame, *, filter_state=None, **options):
    perceiver = Perceiver(WholeFrameDetector(network), PerceptionConfig(look="whole"))
    return perceiver.perceive(frame, filter_state or FilterState.initial(), **options)


class TestSomebody:
    def test_has_keypoints_in_the_frame_s_pixels(self, frame):
        estimate = perceive(DrawnNetwork(STANDING), frame(BLACK))
        assert estimate.keypoints == pytest.approx((STANDING + 0.5) * 16 - 0.5, abs=3)

    def test_stands_where_the_depth_says(self, frame):
        estimate = perceive(DrawnNetwork(STANDING), frame(BLACK, depth=4.0))
        assert estimate.points[:, 0] == pytest.approx(np.full(18, 4.0))
        # The nose is at cell (20, 8), pixel (327.5, 135.5), with a focal length of 457 pixels.
        assert estimate.points[Joint.NOSE] == pytest.approx([4.0, -0.07, 2.41], abs=0.03)

    def test_is_as_sure_as_the_three_components_are_on_average(self, frame):
        estimate = perceive(DrawnNetwork(STANDING), frame(BLACK))
        assert estimate.mass == pytest.approx(np.ones(18))
        assert (estimate.height > 0.4).all()
        expected = (estimate.mass + estimate.height + estimate.distance) / 3
        assert estimate.quality == pytest.approx(expected)

    def test_enters_the_filter(self, frame):
        estimate = perceive(DrawnNetwork(STANDING), frame(BLACK))
        noise = 1 - estimate.quality[Joint.NOSE]
        assert estimate.filter.variance[Joint.NOSE] == pytest.approx(np.full(3, noise / (1 + noise)))
        assert estimate.filter.seen.all()

    def test_without_depth_is_seen_and_not_located(self, frame):
        for depth in (np.nan, 0.0, 20.0):
            estimate = perceive(DrawnNetwork(STANDING), frame(BLACK, depth=depth))
            assert np.isfinite(estimate.keypoints).all()
            assert np.isnan(estimate.points).all()
            assert not estimate.distance.any()
            assert (estimate.mass > 0).all()
            assert not estimate.filter.seen.any()

    def test_the_other_joints_are_found_when_some_are_hidden(self, frame):
        hidden = [Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE]
        estimate = perceive(DrawnNetwork(person(20, 14, without=hidden)), frame(BLACK))
        assert np.isnan(estimate.keypoints[hidden]).all()
        assert not estimate.quality[hidden].any()
        assert (np.delete(estimate.quality, hidden) > 0).all()


class TestNobody:
    def test_is_all_nan_with_no_quality(self, frame):
        estimate = perceive(DrawnNetwork(), frame(BLACK))
        assert np.isnan(estimate.keypoints).all()
        assert np.isnan(estimate.points).all()
        for quality in (estimate.mass, estimate.height, estimate.distance, estimate.quality):
            assert not quality.any()

    def test_leaves_the_filter_s_mean_and_makes_it_less_sure(self, frame):
        before = perceive(DrawnNetwork(STANDING), frame(BLACK)).filter
        after = perceive(DrawnNetwork(), frame(BLACK), filter_state=before).filter
        assert (after.mean == before.mean).all()
        assert after.variance == pytest.approx(before.variance + 0.01)


class TestWhatComesAlong:
    def test_the_truth_is_passed_on(self, frame):
        joints, visible = np.ones((18, 3)), np.arange(18) < 9
        estimate = perceive(DrawnNetwork(), frame(BLACK, joints=joints, visible=visible))
        assert (estimate.joints == joints).all()
        assert (estimate.visible == visible).all()

    def test_heatmaps_come_when_they_are_asked_for(self, frame):
        network = DrawnNetwork(STANDING)
        assert perceive(network, frame(BLACK)).heatmaps is None
        estimate = perceive(network, frame(BLACK), heatmaps=True)
        assert (estimate.heatmaps == network.output.heatmaps).all()
        assert estimate.heatmap_area == (0, 0, 640, 480)

    def test_readings_by_other_ways_of_lifting_come_when_they_are_asked_for(self, frame):
        depth = np.full((480, 640), 4.0, np.float32)
        depth[::2] = 8.0
        picture = replace(frame(BLACK), depth=depth)
        assert perceive(DrawnNetwork(STANDING), picture).readings == {}
        estimate = perceive(DrawnNetwork(STANDING), picture, liftings=("mean", "nearest"))
        assert set(estimate.readings) == {"mean", "nearest"}
        mean, nearest = estimate.readings["mean"], estimate.readings["nearest"]
        assert (nearest.points == estimate.points).all()
        assert (nearest.quality == estimate.quality).all()
        assert (mean.points[:, 0] > 5.5).all()
        assert mean.quality == pytest.approx((estimate.mass + estimate.height + mean.distance) / 3)

    def test_the_profile_of_the_thesis_lifts_by_the_mean(self, frame):
        depth = np.full((480, 640), 4.0, np.float32)
        depth[::2] = 8.0
        picture, nothing = replace(frame(BLACK), depth=depth), FilterState.initial()
        thesis, ours = (
            Perceiver(WholeFrameDetector(DrawnNetwork(STANDING)), PerceptionConfig(), profile=profile)
            for profile in ("thesis", "vantage")
        )
        assert (thesis.perceive(picture, nothing).points[:, 0] > 5.5).all()
        assert ours.perceive(picture, nothing).points[:, 0] == pytest.approx(np.full(18, 4.0))

    def test_the_spread_of_depth_comes_along(self, frame):
        depth = np.full((480, 640), 4.0, np.float32)
        depth[::2] = 8.0
        estimate = perceive(DrawnNetwork(STANDING), replace(frame(BLACK), depth=depth))
        assert estimate.spread == pytest.approx(np.full(18, 4.0))
        assert np.isnan(perceive(DrawnNetwork(), frame(BLACK)).spread).all()

    def test_every_stage_is_timed(self, frame):
        ticks = itertools.count()
        perceiver = Perceiver(WholeFrameDetector(DrawnNetwork()), PerceptionConfig(), clock=lambda: float(next(ticks)))
        estimate = perceiver.perceive(frame(BLACK), FilterState.initial())
        once = dict.fromkeys(("infer", "decode", "qoe", "filter"), 1.0)
        # Evidence is read before there is a quality, and a lifter told of both.
        assert estimate.timings == once | {"lift": 2.0}


@pytest.mark.slow
class TestRealNetwork:
    def test_finds_the_face_of_an_astronaut(self, frame, astronaut):
        # Read off the picture by eye: the nose, and the eyes, her right one to the left in the picture.
        estimate = perceive(open_network(PerceptionConfig()), frame(astronaut))
        found = estimate.keypoints[[Joint.NOSE, Joint.RIGHT_EYE, Joint.LEFT_EYE]]
        assert found == pytest.approx(np.array([[169, 94], [154, 76], [187, 77]]), abs=6)
        assert (estimate.quality[[Joint.NOSE, Joint.RIGHT_EYE, Joint.LEFT_EYE]] > 0.8).all()

    def test_a_black_picture_has_nobody(self, frame):
        assert np.isnan(perceive(open_network(PerceptionConfig()), frame(BLACK)).keypoints).all()


class TestWithALifterThatHasLearned:
    HIDDEN = (Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE)

    def observed(self, frame, **options):
        network = DrawnNetwork(person(20, 14, without=list(self.HIDDEN)))
        perceiver = Perceiver(WholeFrameDetector(network), PerceptionConfig(look="whole"), lifter=lifter())
        state = options.pop("filter_state", FilterState.initial())
        return perceiver.perceive(frame(BLACK, depth=4.0), state, **options)

    def test_every_joint_has_a_place_and_those_that_were_not_found_are_inferred(self, frame):
        estimate = self.observed(frame)
        assert np.isfinite(estimate.points).all()
        assert np.flatnonzero(estimate.inferred).tolist() == sorted(self.HIDDEN)
        for told in (estimate.expected_error, estimate.radius, estimate.variance):
            assert told is not None
            assert (told > 0).all()

    def test_quality_is_what_it_is_without_one(self, frame):
        network = DrawnNetwork(person(20, 14, without=list(self.HIDDEN)))
        without = perceive(network, frame(BLACK, depth=4.0))
        for name in ("mass", "height", "distance", "quality"):
            np.testing.assert_array_equal(getattr(self.observed(frame), name), getattr(without, name))

    def test_a_filter_by_quality_takes_the_joints_that_were_found(self, frame):
        state = self.observed(frame).filter
        assert not state.seen[list(self.HIDDEN)].any()
        assert state.seen.sum() == 16

    def test_a_filter_by_variance_takes_them_all(self, frame):
        state = self.observed(frame, filter_state=FilterState.initial(rule="variance")).filter
        assert state.seen.all()
        assert state.rule == "variance"

    def test_evidence_comes_along_where_it_is_asked_for(self, frame):
        assert self.observed(frame).evidence is None
        evidence = self.observed(frame, evidence=True).evidence
        assert evidence.narrow[Joint.NOSE].tolist() == pytest.approx([1.0] + [4.0] * 6)

    def test_nobody_is_nowhere(self, frame):
        perceiver = Perceiver(WholeFrameDetector(DrawnNetwork()), PerceptionConfig(look="whole"), lifter=lifter())
        estimate = perceiver.perceive(frame(BLACK), FilterState.initial(rule="variance"))
        assert np.isnan(estimate.points).all()
        assert np.isnan(estimate.radius).all()
        assert not estimate.inferred.any()
        assert not estimate.filter.seen.any()
