"""Other people's peaks and the mass of one's own."""

import numpy as np
import pytest

from perception_worker.detection import TrackingDetector, WholeFrameDetector
from perception_worker.perceive import Perceiver
from perception_worker.qoe import nearest_cells, quality_of_estimation
from protocol.config import PerceptionConfig
from protocol.pose_estimate import FilterState
from protocol.skeleton import Joint
from tests.perception_worker.drawn_maps import DrawnNetwork, person
from tests.perception_worker.test_qoe import body

OWN, THEIRS, NOBODYS = (1, 2), (1, 6), (4, 4)


def heatmaps():
    """Every joint's map has the own peak of 0.4, another person's of 0.4, and one of 0.2 that is nobody's."""
    maps = np.zeros((19, 6, 8), np.float32)
    for cell, height in ((OWN, 0.4), (THEIRS, 0.4), (NOBODYS, 0.2)):
        maps[(slice(None), *cell)] = height
    return maps


def mass(maps, *others, own=OWN):
    cells = np.array([np.tile(cell, (18, 1)) for cell in others], dtype=np.int64).reshape(-1, 18, 2)
    return quality_of_estimation(maps, np.tile(own, (18, 1)), body(), others=cells).mass


class TestOtherPeople:
    def test_are_left_out_of_what_the_mass_is_a_share_of(self):
        assert mass(heatmaps()) == pytest.approx(np.full(18, 0.4))
        assert mass(heatmaps(), THEIRS) == pytest.approx(np.full(18, 0.4 / 0.6))

    def test_are_not_told_apart_where_nobody_asks(self):
        unmasked = quality_of_estimation(heatmaps(), np.tile(OWN, (18, 1)), body()).mass
        assert unmasked == pytest.approx(np.full(18, 0.4))

    def test_do_not_excuse_a_peak_that_is_nobodys(self):
        maps = heatmaps()
        maps[:, THEIRS[0], THEIRS[1]] = 0.0
        assert mass(maps, THEIRS) == pytest.approx(np.full(18, 0.4 / 0.6))

    def test_count_once_where_several_stand_in_one_component(self):
        maps = heatmaps()
        maps[:, 1, 7] = 0.3
        assert mass(maps, THEIRS, (1, 7)) == pytest.approx(np.full(18, 0.4 / 0.6))

    def test_in_the_joints_own_component_take_nothing_from_it(self):
        maps = heatmaps()
        maps[:, 1, 3:6] = 0.2
        # One piece of 0.4, 0.2, 0.2, 0.2 and 0.4, and the 0.2 that is nobody's.
        assert mass(maps, THEIRS) == pytest.approx(np.full(18, 1.4 / 1.6))

    def test_leave_height_and_distance_alone(self):
        cells, others = np.tile(OWN, (18, 1)), np.tile(THEIRS, (1, 18, 1))
        alone = quality_of_estimation(heatmaps(), cells, body())
        masked = quality_of_estimation(heatmaps(), cells, body(), others=others)
        assert (masked.height == alone.height).all()
        assert (masked.distance == alone.distance).all()
        assert masked.combined == pytest.approx((masked.mass + masked.height + masked.distance) / 3)

    def test_are_left_out_of_the_maps_of_their_own_joints_only(self):
        others = np.full((1, 18, 2), -1)
        others[0, Joint.NOSE] = THEIRS
        found = quality_of_estimation(heatmaps(), np.tile(OWN, (18, 1)), body(), others=others).mass
        assert found[Joint.NOSE] == pytest.approx(0.4 / 0.6)
        assert np.delete(found, Joint.NOSE) == pytest.approx(np.full(17, 0.4))

    def test_do_not_make_something_of_an_empty_cell(self):
        assert not mass(heatmaps(), THEIRS, own=(3, 0)).any()


def test_a_place_in_a_map_is_in_the_cell_that_it_is_nearest_to():
    # Column and row in, row and column out.
    places = np.array([[[2.49, 1.5], [2.51, 1.49]], [[-0.7, 5.6], [np.nan, np.nan]]])
    assert nearest_cells(places, (6, 8)).tolist() == [[[2, 2], [1, 3]], [[5, 0], [-1, -1]]]
    assert nearest_cells(np.empty((0, 18, 2)), (6, 8)).shape == (0, 18, 2)


class TestPerceiver:
    WHOLE, HALF = person(10, 14), person(29, 14, without=[Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE, Joint.NOSE])

    def mass(self, frame, *people, **settings):
        perceiver = Perceiver(
            WholeFrameDetector(DrawnNetwork(*people)), PerceptionConfig(**settings.pop("perception", {})), **settings
        )
        picture = frame(np.zeros((480, 640, 3), np.uint8))
        estimate = perceiver.perceive(picture, FilterState.initial())
        # The first of the people shows the most joints.
        assert estimate.keypoints == pytest.approx((self.WHOLE + 0.5) * 16 - 0.5, abs=3)
        return estimate.mass

    def test_sees_one_person_as_if_alone(self, frame):
        alone = self.mass(frame, self.WHOLE)
        assert self.mass(frame, self.WHOLE, self.HALF) == pytest.approx(alone, abs=0.05)

    def test_halves_the_mass_by_the_thesis_s_rule(self, frame):
        for settings in ({"profile": "thesis"}, {"perception": {"mask": "none"}}):
            found = self.mass(frame, self.WHOLE, self.HALF, **settings)
            shared = [joint for joint in Joint if np.isfinite(self.HALF[joint, 0])]
            assert found[shared] == pytest.approx(np.full(len(shared), 0.5), abs=0.1)
            assert found[[Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE, Joint.NOSE]] == pytest.approx(np.ones(3))

    def test_masks_as_it_is_told_whatever_the_profile(self, frame):
        own = self.mass(frame, self.WHOLE, self.HALF)
        told = self.mass(frame, self.WHOLE, self.HALF, profile="thesis", perception={"mask": "skeleton"})
        assert (told == own).all()

    def test_finds_others_in_the_region_that_it_looks_at_closer(self, frame):
        near = person(26, 14, without=[Joint.NOSE], scale=0.8)
        network = DrawnNetwork(person(14, 14, scale=0.8), near)
        perceiver = Perceiver(TrackingDetector([network], network), PerceptionConfig())
        estimate = perceiver.perceive(frame(np.zeros((480, 640, 3), np.uint8)), FilterState.initial())
        assert (estimate.mass > 0.9).all()

    def test_a_peak_in_the_outermost_cell_is_in_the_map(self, frame):
        others = [person(39, 29), person(0, 0)]
        for other in others:
            assert (self.mass(frame, self.WHOLE, other) > 0.5).all()
