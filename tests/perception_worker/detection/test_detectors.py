"""Where is looked, how often, and who is taken for the person."""

import time

import cv2
import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.detection import HeldPictures, TrackingDetector, WholeFrameDetector
from perception_worker.detection.choice import open_detector
from perception_worker.perceive import Perceiver
from perception_worker.stopwatch import Stopwatch
from protocol.camera import project
from protocol.config import PerceptionConfig, settled
from protocol.pose_estimate import FilterState
from protocol.region import Region
from protocol.skeleton import Joint
from tests.perception_worker.detection.people import Onlooker, body, camera, frame_of, knows

CAMERA = camera()
PICTURE = frame_of(CAMERA)
WHOLE = Region.whole(480, 640)
BEGINS_HERE = FilterState.initial((0.0, 0.0, 1.2))
"""A filter that knows nobody yet, and has them begin to look where the camera does."""
NOBODY_KNOWN = FilterState.initial((8.0, 0.0, 1.2))
"""Likewise, behind the camera: nothing that it tells is in the picture."""
SOMEBODY = knows(body())


class Watched:
    """People to look at, networks that tell what they were shown, and pictures that tell what was asked for."""

    def __init__(self, *people, taken_by=CAMERA, picture=None, closer=(192, 192)):
        self.whole = Onlooker((240, 320), taken_by, *people)
        self.closer = Onlooker(closer, taken_by, *people)
        self.fetched = []
        self._pictures = HeldPictures(picture or frame_of(taken_by))
        self.camera, self.area, self.timings = taken_by, self._pictures.area, {}

    def part(self, region):
        self.fetched.append(region)
        return self._pictures.part(region)

    def detect(self, filter_state):
        return TrackingDetector([self.whole], self.closer).detect(self, filter_state, Stopwatch(time.perf_counter))


def away(detection, joints, taken_by=CAMERA):
    """Pixels between each keypoint and where the joint is; NaN where it was not found."""
    return np.linalg.norm(detection.keypoints - project(joints, taken_by)[:, :2], axis=1)


class TestWhoIsKnown:
    def test_is_looked_for_where_they_are_expected_and_nothing_else_is_fetched(self):
        watched = Watched(body())
        detection = watched.detect(SOMEBODY)
        assert watched.fetched == watched.closer.shown == [detection.region]
        assert not watched.whole.shown
        assert detection.region.width < 400
        assert detection.found == 18
        assert away(detection, body()).max() < 4

    def test_is_taken_although_another_shows_more_joints(self):
        own = body()
        own[[Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE, Joint.RIGHT_WRIST]] = np.nan
        detection = Watched(own, body(y=0.75)).detect(SOMEBODY)
        assert np.nanmax(away(detection, own)) < 4
        assert len(detection.others) == 1

    def test_is_looked_for_in_all_of_the_picture_when_they_are_not_there(self):
        watched = Watched()
        detection = watched.detect(SOMEBODY)
        assert watched.fetched == [watched.closer.shown[0], WHOLE]
        assert watched.whole.shown == [WHOLE]
        assert detection.found == 0

    def test_is_nobody_when_somebody_else_alone_is_in_the_picture(self):
        detection = Watched(body(y=1.5)).detect(SOMEBODY)
        assert detection.found == 0
        assert len(detection.others) == 1

    def test_is_looked_for_again_when_a_joint_is_at_the_region_s_edge(self):
        moved = body()
        moved[Joint.LEFT_WRIST] = (0.0, 1.1, 1.2)
        watched = Watched(moved)
        detection = watched.detect(SOMEBODY)
        assert watched.fetched == [watched.closer.shown[0], WHOLE]
        assert len(watched.closer.shown) == 2
        assert away(detection, moved).max() < 4

    def test_half_out_of_the_picture_is_not_looked_for_twice(self):
        aside = camera(target=(0.0, 2.6, 1.2))
        watched = Watched(body(), taken_by=aside)
        detection = watched.detect(SOMEBODY)
        assert len(watched.fetched) == 1
        assert 3 <= detection.found < 18

    def test_is_looked_for_in_the_part_that_there_is(self):
        part = PICTURE.part(Region(200, 0, 240, 480))
        watched = Watched(body(), picture=part)
        assert all(region.is_within(part.area) for region in [watched.detect(SOMEBODY).region, *watched.fetched])

    @pytest.mark.parametrize("state", [SOMEBODY, NOBODY_KNOWN])
    def test_is_nobody_in_a_part_of_one_pixel(self, state):
        assert Watched(body(), picture=PICTURE.part(Region(5, 7, 1, 1))).detect(state).found == 0

    def test_is_not_followed_with_a_camera_inside_them(self):
        inside = camera(position=(0.05, 0.0, 1.2), target=(-1.0, 0.0, 1.2))
        watched = Watched(taken_by=inside)
        assert watched.detect(SOMEBODY).found == 0
        assert watched.fetched == [WHOLE]


class TestWhoIsNotKnown:
    def test_is_looked_for_in_the_whole_picture_and_then_closer(self):
        watched = Watched(body())
        detection = watched.detect(NOBODY_KNOWN)
        assert watched.fetched == watched.whole.shown == [WHOLE]
        assert watched.closer.shown == [detection.region]
        assert detection.region != WHOLE
        assert away(detection, body()).max() < 4

    def test_is_whoever_shows_the_most_joints_in_both_looks(self):
        other = body(y=-0.8)
        other[[Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE]] = np.nan
        assert away(Watched(other, body()).detect(NOBODY_KNOWN), body()).max() < 4

    def test_that_nobody_is_there_takes_one_look(self):
        watched = Watched()
        assert watched.detect(NOBODY_KNOWN).found == 0
        assert not watched.closer.shown

    def test_who_fills_the_picture_is_not_looked_at_closer(self):
        near = camera(position=(1.0, 0.0, 1.2))
        wide = body()
        wide[[Joint.LEFT_WRIST, Joint.RIGHT_WRIST], 1] = 0.69, -0.69
        watched = Watched(wide, taken_by=near)
        assert watched.detect(NOBODY_KNOWN).region == WHOLE
        assert not watched.closer.shown

    def test_a_closer_look_that_loses_the_person_is_not_believed(self):
        watched = Watched(body())
        blind = Onlooker((192, 192), CAMERA)
        detection = TrackingDetector([watched.whole], blind).detect(watched, NOBODY_KNOWN, Stopwatch(time.perf_counter))
        assert len(blind.shown) == 1
        assert detection.region == WHOLE
        assert detection.found == 18


class TestWhoIsSupposed:
    """The filter knows nobody, and where it begins to look is in the picture."""

    def test_is_looked_for_there_and_then_closer_and_the_whole_picture_is_not_fetched(self):
        watched = Watched(body(y=0.3))
        detection = watched.detect(BEGINS_HERE)
        assert not watched.whole.shown
        assert watched.closer.shown == [watched.fetched[0], detection.region]
        assert WHOLE not in watched.fetched
        assert away(detection, body(y=0.3)).max() < 4

    def test_is_looked_at_closer_in_what_was_fetched_if_that_holds_them(self):
        watched = Watched(body(), closer=(192, 128))
        detection = watched.detect(BEGINS_HERE)
        assert watched.fetched == [watched.closer.shown[0]]
        assert detection.region.is_within(watched.fetched[0])

    def test_is_fetched_whole_when_they_reach_beyond_it(self):
        aside = body(y=0.7)
        watched = Watched(aside)
        detection = watched.detect(BEGINS_HERE)
        assert watched.fetched == watched.closer.shown == [watched.fetched[0], detection.region]
        assert detection.found == 18
        assert away(detection, aside).max() < 4

    def test_is_the_nearer_of_two_although_the_other_shows_more_joints(self):
        own = body(y=-0.1)
        own[[Joint.RIGHT_ANKLE, Joint.LEFT_ANKLE]] = np.nan
        assert np.nanmax(away(Watched(body(y=0.7), own).detect(BEGINS_HERE), own)) < 4

    def test_is_looked_for_in_the_whole_picture_when_too_little_of_anybody_is_there(self):
        elsewhere = body(y=1.5)
        watched = Watched(elsewhere)
        detection = watched.detect(BEGINS_HERE)
        assert watched.fetched == [watched.closer.shown[0], WHOLE]
        assert watched.whole.shown == [WHOLE]
        assert away(detection, elsewhere).max() < 4

    def test_is_looked_for_in_the_whole_picture_when_a_closer_look_loses_them(self):
        few = np.where(np.arange(18)[:, None] < 7, body(), np.nan)
        watched, seen = Watched(body()), Onlooker((192, 192), CAMERA, few)
        fickle = Fickle(seen, Onlooker((192, 192), CAMERA))
        detection = TrackingDetector([watched.whole], fickle).detect(watched, BEGINS_HERE, Stopwatch(time.perf_counter))
        assert watched.whole.shown == [WHOLE]
        assert detection.found == 18

    def test_who_was_lost_is_looked_for_where_they_were(self):
        lost = knows(body(y=0.5), deviation=1.1)
        watched = Watched(body(y=0.4))
        detection = watched.detect(lost)
        assert not watched.whole.shown
        assert away(detection, body(y=0.4)).max() < 4


class Fickle:
    """A network that sees as one onlooker does at first, and as another from then on."""

    def __init__(self, first, then):
        self.input_size = first.input_size
        self._first, self._then = first, then

    def infer(self, rgb):
        return (self._then if self._first.shown else self._first).infer(rgb)

    def decode(self, output):
        return self._first.decode(output)


class TestSearch:
    """By two networks, of which the second sees the picture larger."""

    def search(self, small, large, *, larger_closer=None):
        watched = Watched(*large)
        quick, closer = Onlooker((120, 160), CAMERA, *small), larger_closer or watched.closer
        detection = TrackingDetector([quick, watched.whole], closer).detect(
            watched, NOBODY_KNOWN, Stopwatch(time.perf_counter)
        )
        assert watched.fetched == quick.shown == [WHOLE]
        return detection, watched

    def test_ends_with_the_first_network_that_finds_enough_of_somebody(self):
        detection, watched = self.search([body()], [body()])
        assert not watched.whole.shown
        assert watched.closer.shown == [detection.region]
        assert detection.found == 18

    def test_goes_on_with_the_next_one_where_nobody_was_found(self):
        detection, watched = self.search([], [body()])
        assert watched.whole.shown == [WHOLE]
        assert watched.closer.shown == [detection.region]
        assert away(detection, body()).max() < 4

    def test_goes_on_where_too_few_joints_were_found_also_closer(self):
        few = np.where(np.arange(18)[:, None] < 4, body(), np.nan)
        blind = Onlooker((192, 192), CAMERA)
        detection, watched = self.search([few], [body()], larger_closer=blind)
        assert watched.whole.shown == [WHOLE]
        assert detection.found == 18

    def test_keeps_what_the_quicker_one_has_found_where_the_other_finds_less(self):
        few = np.where(np.arange(18)[:, None] < 4, body(), np.nan)
        detection, watched = self.search([few], [], larger_closer=Onlooker((192, 192), CAMERA))
        assert watched.whole.shown == [WHOLE]
        assert detection.found == 4


class TestWholeFrameDetector:
    def test_sees_the_whole_picture_whoever_is_known(self):
        for state in (NOBODY_KNOWN, SOMEBODY):
            watched = Watched(body(), body(y=1.5))
            detection = WholeFrameDetector(watched.whole).detect(watched, state, Stopwatch(time.perf_counter))
            assert watched.fetched == watched.whole.shown == [WHOLE]
            assert detection.region == WHOLE


class TestPerceiver:
    def perceive(self, state, **options):
        watched = Watched(body())
        perceiver = Perceiver(TrackingDetector([watched.whole], watched.closer), PerceptionConfig())
        return perceiver.observe(watched, state, **options)

    def test_speaks_of_the_whole_picture_s_pixels(self):
        estimate = self.perceive(SOMEBODY, heatmaps=True)
        assert estimate.keypoints == pytest.approx(project(body(), CAMERA)[:, :2], abs=4)
        assert estimate.points == pytest.approx(body(), abs=0.05)
        left, top, width, height = estimate.heatmap_area
        assert Region(left, top, width, height).is_within(WHOLE)
        assert width < 400

    def test_reads_quality_at_the_right_cells_of_the_region(self):
        estimate = self.perceive(SOMEBODY)
        assert estimate.mass == pytest.approx(np.ones(18), abs=0.01)
        assert (estimate.height > 0.4).all()

    @pytest.mark.parametrize("look", ["whole", "track"])
    def test_does_not_believe_a_joint_on_the_wall_of_whom_it_tracks(self, look):
        x, y = np.rint(project(body(), CAMERA)[Joint.RIGHT_WRIST, :2]).astype(int)
        depth = PICTURE.depth.copy()
        depth[y - 9 : y + 10, x - 9 : x + 10] = 6.0
        watched = Watched(body(), picture=replace(PICTURE, depth=depth))
        ways = {"whole": WholeFrameDetector(watched.whole), "track": TrackingDetector([watched.whole], watched.closer)}
        estimate = Perceiver(ways[look], PerceptionConfig(look=look)).observe(watched, SOMEBODY)
        located = np.isfinite(estimate.points[:, 0])
        assert located[Joint.RIGHT_WRIST] == (look == "whole")
        assert np.delete(located, Joint.RIGHT_WRIST).all()
        assert np.isfinite(estimate.keypoints).all()

    def test_goes_on_from_its_own_filter(self):
        first = self.perceive(NOBODY_KNOWN)
        second = self.perceive(first.filter, heatmaps=True)
        assert second.heatmap_area != (0, 0, 640, 480)
        assert (second.filter.variance < first.filter.variance).all()


@pytest.mark.slow
class TestRealNetwork:
    def test_a_closer_look_sees_a_person_who_is_too_far_for_the_whole_frame(self, frame, astronaut):
        rgb = np.full((960, 1280, 3), 128, np.uint8)
        rgb[400:560, 700:860] = cv2.resize(astronaut, (160, 160), interpolation=cv2.INTER_AREA)
        config = replace(settled(PerceptionConfig(), "vantage"), input_height=240, input_width=320)
        once, twice = (
            Perceiver(open_detector(replace(config, look=look)), config).perceive(frame(rgb), NOBODY_KNOWN).keypoints
            for look in ("whole", "track")
        )
        assert np.isfinite(twice[:, 0]).sum() > np.isfinite(once[:, 0]).sum()
        face = twice[[Joint.NOSE, Joint.RIGHT_EYE, Joint.LEFT_EYE]]
        expected = np.array([[169, 94], [154, 76], [187, 77]]) * 160 / 384 + np.array([700, 400])
        assert face == pytest.approx(expected, abs=3)
