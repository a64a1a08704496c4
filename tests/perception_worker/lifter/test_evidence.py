import numpy as np
import pytest

from perception_worker.lifter.evidence import FRONT, LEAST, SHARE, evidence_of, front_depths, median_of_known
from protocol.skeleton import JOINT_COUNT, Joint

NOWHERE = np.full((JOINT_COUNT, 2), np.nan)


def at(joint: int, x: float, y: float) -> np.ndarray:
    keypoints = NOWHERE.copy()
    keypoints[joint] = x, y
    return keypoints


def test_tells_share_and_quantiles_of_the_depths_around_a_keypoint():
    depth = np.full((40, 40), 4.0, np.float32)
    depth[:, :20] = 2.0
    told = evidence_of(depth, at(3, 19.0, 20.0), 100.0).narrow[3]
    # Columns 16 to 22: four of seven are near, 28 of 49 pixels.
    assert told.tolist() == [1.0, 2.0, 2.0, 2.0, 2.0, 4.0, 4.0]


def test_does_not_believe_what_a_depth_camera_can_not_measure():
    depth = np.full((40, 40), 3.0, np.float32)
    depth[17:24, 17:20], depth[17:24, 20:22] = 0.2, np.nan
    depth[17:24, 22:24] = np.inf
    depth[20, 23] = 2.5
    told = evidence_of(depth, at(0, 20.0, 20.0), 100.0).narrow[0]
    assert told[SHARE] == pytest.approx(1 / 49)
    assert told[LEAST:].tolist() == [2.5] * 6


def test_says_nothing_of_a_joint_that_was_not_found_or_of_no_depth():
    evidence = evidence_of(np.full((40, 40), np.nan, np.float32), at(5, 20.0, 20.0), 100.0)
    for window in (evidence.narrow, evidence.wide):
        assert not window[:, SHARE].any()
        assert np.isnan(window[:, LEAST:]).all()


def test_a_wide_window_is_as_large_as_a_body_s_part_where_the_body_is():
    depth = np.full((480, 640), 2.0, np.float32)
    # 9 cm at 2 m and 400 pixels a unit are 18 pixels.
    depth[240, 320 + 18], depth[240, 320 - 19] = 1.0, 0.5
    assert evidence_of(depth, at(1, 320.0, 240.0), 400.0).wide[1, LEAST] == 1.0


def test_keypoints_far_outside_of_the_picture_have_no_depth():
    evidence = evidence_of(np.full((40, 40), 2.0, np.float32), at(2, 1e300, -5e9), 100.0)
    assert evidence.narrow[2, SHARE] == 0.0


def test_the_body_is_where_its_torso_is():
    narrow = np.full((1, JOINT_COUNT, 7), np.nan, np.float32)
    narrow[0, :, FRONT] = 7.0
    narrow[0, [Joint.NECK, Joint.LEFT_HIP], FRONT] = 2.0, 3.0
    narrow[0, [Joint.RIGHT_SHOULDER, Joint.LEFT_SHOULDER, Joint.RIGHT_HIP], FRONT] = np.nan
    assert median_of_known(front_depths(narrow)).tolist() == [2.5]
    narrow[0, Joint.NECK, FRONT] = np.nan
    assert median_of_known(front_depths(narrow)).tolist() == [7.0]


@pytest.mark.parametrize("values", [[1.0, np.nan, 5.0], [np.nan] * 3, [4.0, 1.0, 2.0], [np.nan, 3.0, np.nan]])
def test_the_median_of_what_is_known_is_numpys(values):
    wanted = np.nan if np.isnan(values).all() else np.nanmedian(values)
    np.testing.assert_array_equal(median_of_known(np.array([values])), [wanted])
