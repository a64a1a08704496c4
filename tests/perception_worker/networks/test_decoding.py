import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.networks.decoding import MOST_PEAKS, decode, find_peaks, group
from perception_worker.networks.network import NetworkOutput
from protocol.skeleton import Joint
from tests.perception_worker import reference_decoding
from tests.perception_worker.drawn_maps import draw, person

LEGS = [Joint.RIGHT_KNEE, Joint.RIGHT_ANKLE, Joint.LEFT_KNEE, Joint.LEFT_ANKLE]


def one_map(heatmap):
    """A heatmap of the nose; the other maps are empty."""
    heatmaps = np.zeros((19, *np.shape(heatmap)), np.float32)
    heatmaps[Joint.NOSE] = heatmap
    return heatmaps


def person_in(output, threshold):
    """Whom the frame is about."""
    return decode(output, threshold).person


class TestPeaks:
    def test_are_refined_by_the_parabola_through_their_neighbours(self):
        # (0.4, 1, 0.8) has its summit at 0.5 * (0.4 - 0.8) / (0.4 - 2 + 0.8) = 0.25 of a cell further.
        heatmap = np.zeros((5, 7))
        heatmap[2, 2:5] = 0.4, 1.0, 0.8
        heatmap[1:4, 3] = 0.8, 1.0, 0.4
        peaks = find_peaks(one_map(heatmap), 0.1)
        assert peaks.position == pytest.approx(np.array([[3.25, 1.75]]))
        assert peaks.height == pytest.approx([1.0])
        assert list(peaks.joint) == [Joint.NOSE]

    def test_at_the_border_stay_in_their_cell(self):
        heatmap = np.zeros((5, 7))
        heatmap[0, 6], heatmap[0, 5], heatmap[1, 6] = 1.0, 0.9, 0.9
        assert find_peaks(one_map(heatmap), 0.1).position == pytest.approx(np.array([[6.0, 0.0]]))

    def test_must_exceed_the_threshold(self):
        heatmap = np.zeros((5, 7))
        heatmap[2, 2], heatmap[2, 5] = 0.125, 0.25
        assert len(find_peaks(one_map(heatmap), 0.125).height) == 1
        assert len(find_peaks(one_map(heatmap), 0.25).height) == 0

    def test_a_neighbour_at_a_corner_hides_a_lower_cell(self):
        heatmap = np.zeros((5, 7))
        heatmap[2, 2], heatmap[3, 3] = 0.5, 0.4
        assert len(find_peaks(one_map(heatmap), 0.1).height) == 1

    def test_a_plateau_is_one_peak(self):
        assert len(find_peaks(one_map(np.full((5, 7), 0.5)), 0.1).height) == 1

    def test_come_by_joint_and_falling_height(self):
        heatmaps = one_map(np.zeros((5, 9)))
        heatmaps[Joint.NECK, 2, [1, 4, 7]] = 0.3, 0.9, 0.6
        heatmaps[Joint.NOSE, 2, 2] = 0.2
        peaks = find_peaks(heatmaps, 0.1)
        assert list(peaks.joint) == [Joint.NOSE, Joint.NECK, Joint.NECK, Joint.NECK]
        assert peaks.height == pytest.approx([0.2, 0.9, 0.6, 0.3])

    def test_of_noise_only_the_highest_are_kept(self):
        heatmap = np.random.default_rng(0).random((30, 40))
        peaks = find_peaks(one_map(heatmap), 0.1)
        assert len(peaks.height) == MOST_PEAKS
        assert peaks.height[0] == pytest.approx(heatmap.max())

    def test_the_background_has_none(self):
        heatmaps = np.zeros((19, 5, 7), np.float32)
        heatmaps[18, 2, 2] = 1.0
        assert len(find_peaks(heatmaps, 0.1).height) == 0

    @given(st.integers(0, 2**32 - 1))
    def test_are_no_lower_than_any_neighbour(self, seed):
        heatmap = np.random.default_rng(seed).integers(0, 4, (6, 8)) / 4
        peaks = find_peaks(one_map(heatmap), 0.1)
        assert heatmap.max() <= 0.1 or peaks.height[0] == heatmap.max()
        for (column, row), height in zip(np.rint(peaks.position).astype(int), peaks.height, strict=True):
            patch = heatmap[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
            assert height in patch


class TestOnePerson:
    @given(st.floats(8, 31), st.floats(9, 19))
    def test_every_joint_is_found_within_a_sixth_of_a_cell(self, column, row):
        joints = person(column, row)
        assert person_in(draw([joints]), 0.1) == pytest.approx(joints, abs=1 / 6)

    def test_joints_that_are_hidden_are_not_detected(self):
        joints = person(20, 14, without=LEGS)
        found = person_in(draw([joints]), 0.1)
        assert np.isnan(found[LEGS]).all()
        assert np.isfinite(np.delete(found, LEGS, axis=0)).all()

    def test_an_empty_picture_has_nobody(self):
        assert np.isnan(person_in(draw([]), 0.1)).all()

    def test_a_peak_that_no_limb_reaches_is_nobody(self):
        output = draw([person(20, 14, without=[joint for joint in Joint if joint != Joint.NOSE])])
        assert output.heatmaps[Joint.NOSE].max() > 0.5
        assert np.isnan(person_in(output, 0.1)).all()

    def test_a_field_that_runs_backwards_makes_no_limb(self):
        joints = person(20, 14, without=[joint for joint in Joint if joint not in (Joint.NOSE, Joint.NECK)])
        output = draw([joints])
        assert np.isfinite(person_in(output, 0.1)).any()
        assert np.isnan(person_in(NetworkOutput(output.heatmaps, -output.pafs), 0.1)).all()

    def test_a_false_peak_off_the_limb_is_not_taken(self):
        joints = person(20, 14)
        output = draw([joints])
        output.heatmaps[Joint.RIGHT_WRIST, 3, 36] = 1.0
        assert person_in(output, 0.1)[Joint.RIGHT_WRIST] == pytest.approx(joints[Joint.RIGHT_WRIST], abs=1 / 6)

    def test_of_two_peaks_on_a_limb_the_better_supported_one_is_taken(self):
        # The field ends one cell after the wrist: a peak two cells further has it along three quarters of the way.
        joints = person(20, 14)
        joints[[Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST]] = (10, 12), (10, 17)
        output = draw([joints])
        output.heatmaps[Joint.RIGHT_WRIST] = 0
        output.heatmaps[Joint.RIGHT_WRIST, [17, 19], 10] = 0.5, 0.9
        assert person_in(output, 0.1)[Joint.RIGHT_WRIST] == pytest.approx([10, 17])

    def test_halves_of_a_body_found_apart_are_joined(self):
        # Without a neck, only the limbs from shoulders to ears link arms and head, and those are tried last.
        joints = person(20, 14, without=[Joint.NECK])
        found = person_in(draw([joints]), 0.1)
        head_and_arms = [Joint.NOSE, Joint.LEFT_EYE, Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST, Joint.LEFT_WRIST]
        assert found[head_and_arms] == pytest.approx(joints[head_and_arms], abs=1 / 6)

    def test_noise_is_decoded_too(self):
        rng = np.random.default_rng(1)
        output = NetworkOutput(
            rng.random((19, 30, 40), dtype=np.float32), rng.normal(size=(38, 30, 40)).astype(np.float32)
        )
        assert person_in(output, 0.1).shape == (18, 2)

    def test_a_picture_of_one_has_nobody_else(self):
        assert decode(draw([person(20, 14)]), 0.1).others.shape == (0, 18, 2)
        assert decode(draw([]), 0.1).others.shape == (0, 18, 2)


class TestTwoPeople:
    def test_the_one_with_more_joints_is_taken(self):
        whole, half = person(10, 14), person(29, 14, without=LEGS)
        for people in ([whole, half], [half, whole]):
            found = person_in(draw(people, heights=[0.5, 0.5]), 0.1)
            assert found == pytest.approx(whole, abs=1 / 6)

    def test_more_joints_count_before_higher_peaks(self):
        whole, half = person(10, 14), person(29, 14, without=LEGS)
        assert person_in(draw([whole, half], heights=[0.3, 0.9]), 0.1) == pytest.approx(whole, abs=1 / 6)

    def test_between_equals_the_higher_peaks_decide(self):
        left, right = person(10, 14), person(29, 14)
        assert person_in(draw([left, right], heights=[0.4, 0.6]), 0.1) == pytest.approx(right, abs=1 / 6)
        assert person_in(draw([left, right], heights=[0.6, 0.4]), 0.1) == pytest.approx(left, abs=1 / 6)

    def test_their_joints_are_not_mixed(self):
        left, right = person(12, 14), person(27, 14, without=[Joint.LEFT_WRIST])
        assert person_in(draw([left, right]), 0.1) == pytest.approx(left, abs=1 / 6)

    def test_everybody_else_is_told_as_well(self):
        whole, half, third = person(8, 14), person(20, 14, without=LEGS), person(32, 14, without=[*LEGS, Joint.NOSE])
        people = decode(draw([third, whole, half]), 0.1)
        assert people.person == pytest.approx(whole, abs=1 / 6)
        for found, true in zip(people.others, (half, third), strict=True):
            assert found == pytest.approx(true, abs=1 / 6, nan_ok=True)


def same_people(output, threshold=0.1):
    """Whether decoding and its plain reference find the same, to a millionth of a cell."""
    found = decode(output, threshold)
    expected = np.full((1 + len(found.others), 18, 2), np.nan)
    plain = reference_decoding.people(output.heatmaps, output.pafs, threshold)
    assert max(len(plain), 1) == len(expected)
    for row, skeleton in zip(expected, plain, strict=False):
        row[list(skeleton)] = list(skeleton.values())
    np.testing.assert_allclose(np.stack([found.person, *found.others]), expected, rtol=0, atol=1e-6)


def noise(rng, size, *, people=0, level=0.3):
    """Random maps, some people among them."""
    rows, columns = size
    places = [(rng.uniform(4, columns - 4), rng.uniform(8, rows - 10)) for _ in range(people)]
    drawn = draw([person(*place) for place in places], size=size, heights=rng.uniform(0.2, 0.9, people).tolist())
    return NetworkOutput(
        (drawn.heatmaps + level * rng.random(drawn.heatmaps.shape)).astype(np.float32),
        (drawn.pafs + level * rng.normal(size=drawn.pafs.shape)).astype(np.float32),
    )


class TestReference:
    """Decoding by whole arrays against loops over cells."""

    @pytest.mark.parametrize("seed", range(4))
    def test_agrees_on_people_in_noise(self, seed):
        rng = np.random.default_rng(seed)
        same_people(noise(rng, (30, 40), people=seed, level=0.15), threshold=0.1)

    def test_agrees_where_nothing_is_seen(self):
        same_people(draw([]))

    @pytest.mark.slow
    @pytest.mark.parametrize("seed", range(40))
    def test_agrees_on_random_maps_of_any_size(self, seed):
        rng = np.random.default_rng([9, seed])
        size = tuple(int(side) for side in rng.integers(1, 33, 2))
        maps = NetworkOutput(
            rng.normal(0.0, 0.3, (19, *size)).astype(np.float32), rng.normal(0.1, 0.2, (38, *size)).astype(np.float32)
        )
        same_people(maps, threshold=float(rng.uniform(0.1, 0.6)))

    @pytest.mark.slow
    @pytest.mark.parametrize("seed", range(40))
    def test_agrees_on_crowds_in_noise(self, seed):
        rng = np.random.default_rng([8, seed])
        same_people(noise(rng, (30, 40), people=int(rng.integers(0, 5)), level=rng.uniform(0.0, 0.3)), threshold=0.1)

    def test_agrees_on_the_peaks_of_plateaus(self):
        # Peaks alone: between limbs of equal scores rounding decides.
        rng = np.random.default_rng(7)
        for _ in range(20):
            heatmap = rng.integers(0, 4, (6, 8)) / 4
            found = find_peaks(one_map(heatmap), 0.1)
            expected = reference_decoding.peaks(heatmap.tolist(), 0.1)
            assert list(found.height) == [height for _, height in expected]
            np.testing.assert_allclose(found.position, [place for place, _ in expected], rtol=0, atol=1e-6)


class TestSkeletons:
    def skeletons(self, *people):
        output = draw(people)
        return group(find_peaks(output.heatmaps, 0.1), output.pafs)

    def test_are_as_many_as_there_are_people(self):
        assert [len(one) for one in self.skeletons(person(12, 14), person(27, 14))] == [18, 18]

    def test_are_no_more_when_a_body_is_put_together_from_parts(self):
        # Without a neck the legs hang on nothing; both arms and the head are put together by the ears.
        assert [len(one) for one in self.skeletons(person(20, 14, without=[Joint.NECK]))] == [11, 3, 3]

    def test_share_no_joint(self):
        skeletons = self.skeletons(person(14, 14), person(18, 14), person(23, 15))
        peaks = [peak for skeleton in skeletons for peak in skeleton.values()]
        assert len(peaks) == len(set(peaks))
