import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.pictures.picture import (
    HIDDEN_COLOUR,
    LEFT_COLOUR,
    MIDDLE_COLOUR,
    QUALITY_STOPS,
    RIGHT_COLOUR,
    TRUTH_COLOUR,
    UNKNOWN_COLOUR,
    DepthScale,
    Window,
    cut,
    depth_picture,
    depth_scale,
    enlarged,
    heatmap_picture,
    magnified_pixels,
    quality_colour,
    side_colour,
    skeleton_picture,
    true_pixels,
    truth_picture,
    window_around,
)
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.skeleton import LIMBS, Joint

BLACK = np.zeros((120, 160, 3), np.uint8)


def nobody() -> np.ndarray:
    return np.full((18, 2), np.nan)


def test_the_colours_of_quality_are_red_yellow_and_blue_with_mixtures_between():
    assert [quality_colour(quality) for quality in (0.0, 0.5, 1.0)] == list(QUALITY_STOPS)
    red, yellow = QUALITY_STOPS[:2]
    assert quality_colour(0.25) == tuple(round((a + b) / 2) for a, b in zip(red, yellow, strict=True))


def test_limbs_have_the_colour_of_their_side():
    assert side_colour((Joint.LEFT_KNEE, Joint.LEFT_ANKLE)) == LEFT_COLOUR
    assert side_colour((Joint.NECK, Joint.RIGHT_SHOULDER)) == RIGHT_COLOUR
    assert side_colour((Joint.NECK, Joint.NOSE)) == MIDDLE_COLOUR
    sides = [side_colour(limb) for limb in LIMBS]
    assert sides.count(LEFT_COLOUR) == sides.count(RIGHT_COLOUR) == 8


def test_a_joint_is_a_disc_of_its_qualitys_colour():
    keypoints, quality = nobody(), np.zeros(18)
    keypoints[Joint.NOSE], quality[Joint.NOSE] = (80, 60), 1.0
    drawn = skeleton_picture(BLACK, keypoints, quality, marker=6)
    assert tuple(drawn[60, 80]) == QUALITY_STOPS[2]
    assert tuple(drawn[60, 85]) == QUALITY_STOPS[2]
    assert not drawn[60, 92:].any()
    assert not BLACK.any()


def test_a_limb_is_a_line_of_its_sides_colour_where_both_ends_are_found():
    keypoints = nobody()
    keypoints[[Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW, Joint.RIGHT_SHOULDER]] = (30, 20), (30, 100), (130, 20)
    drawn = skeleton_picture(BLACK, keypoints, np.ones(18))
    assert tuple(drawn[60, 30]) == LEFT_COLOUR
    assert not drawn[60, 100:].any()


def test_nobody_found_leaves_the_picture_as_it_is():
    assert (skeleton_picture(BLACK, nobody(), np.zeros(18)) == BLACK).all()


def test_a_true_joint_in_sight_is_a_white_diagonal_cross_and_a_hidden_one_a_grey_upright_one():
    pixels, visible = nobody(), np.zeros(18, bool)
    pixels[0], pixels[1], visible[0] = (40, 60), (120, 60), True
    drawn = truth_picture(BLACK, pixels, visible, arm=4)
    diagonal, upright = [(0, 0), (3, 3), (-3, 3)], [(0, 0), (0, 4), (4, 0)]
    assert [tuple(drawn[60 + y, 40 + x]) for y, x in diagonal] == [TRUTH_COLOUR] * 3
    # Its strokes end between pixels, so they are not of the full colour.
    assert [drawn[60 + y, 120 + x] for y, x in upright] == [pytest.approx(HIDDEN_COLOUR, abs=20)] * 3
    assert max(drawn[60, 44].max(), drawn[63, 123].max()) < 20


def test_a_joint_far_outside_the_picture_is_no_trouble():
    pixels = np.full((18, 2), 1e12)
    assert (truth_picture(BLACK, pixels, np.ones(18, bool)) == BLACK).all()


def test_true_joints_are_where_the_camera_sees_them_and_nowhere_behind_it():
    camera = Camera(CameraPose((3.0, 0.0, 1.0), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(161, 121, 90.0))
    joints = np.zeros((18, 3))
    joints[:, 2] = 1.0
    joints[1] = (4.0, 0.0, 1.0)
    pixels = true_pixels(joints, camera)
    assert pixels[0] == pytest.approx((80.0, 60.0))
    assert np.isnan(pixels[1]).all()


def test_what_was_not_measured_is_grey_and_the_nearest_is_redder_than_the_farthest():
    depth = np.array([[2.0, 8.0, 0.0, np.nan, np.inf]], np.float32)
    drawn = depth_picture(depth, depth_scale(depth)).astype(int)
    assert [tuple(pixel) for pixel in drawn[0, 2:]] == [UNKNOWN_COLOUR] * 3
    assert drawn[0, 0, 0] > drawn[0, 0, 2]
    assert drawn[0, 1, 2] > drawn[0, 1, 0]


def test_a_depth_scale_leaves_out_the_few_farthest_and_what_was_not_measured():
    depth = np.full((10, 10), 4.0, np.float32)
    depth[0], depth[1, :2] = (0.0, np.nan, 2.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0), 900.0
    assert depth_scale(depth) == DepthScale(2.0, 4.0)


@pytest.mark.parametrize("depth", [np.zeros((4, 4)), np.full((4, 4), np.nan), np.full((4, 4), 3.0)])
def test_a_depth_picture_of_one_distance_or_none_can_be_drawn(depth):
    depth = depth.astype(np.float32)
    assert depth_picture(depth, depth_scale(depth)).shape == (4, 4, 3)


def test_a_depth_scale_goes_by_one_over_the_distance():
    scale = DepthScale(near=1.0, far=4.0)
    assert scale.share(np.array([1.0, 1.6, 4.0])) == pytest.approx([1.0, 0.5, 0.0])
    assert scale.distance(np.array([1.0, 0.5, 0.0])) == pytest.approx([1.0, 1.6, 4.0])


def test_a_heatmap_glows_where_it_is_high_and_the_background_map_does_not_count():
    heatmaps = np.zeros((19, 12, 16), np.float32)
    heatmaps[3, 6, 8] = 1.0
    heatmaps[18] = 1.0
    drawn = heatmap_picture(BLACK, heatmaps)
    assert drawn[60:70, 80:90].max() > 200
    assert not drawn[:40].any()


@pytest.mark.parametrize("area", [Window(100, 40, 40, 30), Window(140, 100, 40, 30), Window(-20, -10, 40, 30)])
def test_a_heatmap_of_a_part_of_the_picture_glows_there_only(area):
    drawn = heatmap_picture(BLACK, np.ones((19, 12, 16), np.float32), area)
    glowing = drawn.max(axis=2) > 100
    covered = np.zeros((120, 160), bool)
    covered[max(area.y, 0) : area.y + area.height, max(area.x, 0) : area.x + area.width] = True
    assert (glowing == covered).all()


@given(x=st.floats(0, 159), y=st.floats(0, 119), width=st.integers(200, 900))
def test_a_pixel_of_a_window_is_found_again_in_the_magnified_window(x, y, width):
    window = Window(10, 20, 80, 60)
    [[mx, my]] = magnified_pixels(np.array([[x, y]]), window, width)
    factor = width / 80
    assert ((mx + 0.5) / factor - 0.5 + 10, (my + 0.5) / factor - 0.5 + 20) == pytest.approx((x, y))


def test_a_magnified_pixel_lies_on_the_same_spot_of_the_picture():
    picture = BLACK.copy()
    picture[70, 50] = 255
    window = Window(20, 40, 80, 60)
    magnified = enlarged(cut(picture, window), 640)
    [[x, y]] = np.round(magnified_pixels(np.array([[50.0, 70.0]]), window, 640)).astype(int)
    assert magnified[y, x].min() > 200
    assert magnified[y - 12, x].max() < 60


@given(st.lists(st.tuples(st.floats(-50, 210), st.floats(-50, 170)), max_size=18))
def test_a_window_lies_within_the_picture_in_its_proportions(points):
    window = window_around(np.array(points, float).reshape(-1, 2), 160, 120)
    assert 0 <= window.x <= window.x + window.width <= 160
    assert 0 <= window.y <= window.y + window.height <= 120
    assert window.width / window.height == pytest.approx(4 / 3, abs=0.1)


def test_a_window_holds_all_points_that_are_in_the_picture():
    points = np.array([[60.0, 40.0], [90.0, 100.0], [np.nan, np.nan]])
    window = window_around(points, 160, 120)
    assert window.x <= 60
    assert window.x + window.width > 90
    assert window.y <= 40
    assert window.y + window.height > 100
    assert window.width < 160


def test_without_points_the_window_is_the_whole_picture():
    assert window_around(nobody(), 160, 120) == Window(0, 0, 160, 120)
