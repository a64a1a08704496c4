from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.pictures import picture
from orchestrator.pictures.person_in_space import person_in_space
from orchestrator.pictures.picture import DepthScale
from orchestrator.pictures.scene_page import (
    BAR_COLUMN,
    CAPTION,
    GAP,
    HEADER,
    MARGIN,
    METRES_WIDTH,
    PANEL_WIDTH,
    ROW,
    depth_ticks,
    draw_scene_page,
    space_words,
)
from orchestrator.pictures.space_picture import volume_around
from protocol.camera import Camera, CameraPose, Intrinsics, project
from protocol.frame import Frame
from protocol.pose_estimate import FilterState, PoseEstimate


def frame_and_observation(width: int = 64, height: int = 48, found: bool = True) -> tuple[Frame, PoseEstimate]:
    camera = Camera(CameraPose((3.0, 0.0, 1.2), (0.0, 0.0, 1.2)), Intrinsics.from_horizontal_fov(width, height, 70.0))
    joints = np.stack([np.zeros(18), np.linspace(-0.4, 0.4, 18), np.linspace(0.2, 1.7, 18)], axis=1)
    keypoints = project(joints, camera)[:, :2] if found else np.full((18, 2), np.nan)
    quality = np.ones(18) if found else np.zeros(18)
    frame = Frame(
        rgb=np.full((height, width, 3), (90, 140, 60), np.uint8),
        depth=np.full((height, width), 3.0, np.float32),
        camera=camera,
        joints=joints,
        visible=np.ones(18, bool),
    )
    observation = PoseEstimate(
        keypoints=keypoints,
        points=joints,
        mass=quality,
        height=quality,
        distance=quality,
        quality=quality,
        filter=FilterState.initial(),
        heatmaps=np.zeros((19, 6, 8), np.float32),
    )
    return frame, observation


def test_the_colour_panel_is_the_frame_itself():
    page = draw_scene_page("Scene 1", "from the front", *frame_and_observation())
    panel = page[HEADER + CAPTION + 10 : HEADER + CAPTION + 400, MARGIN + 10 : MARGIN + PANEL_WIDTH - 10]
    assert (panel == (90, 140, 60)).all()


def test_the_joints_of_good_quality_are_blue_on_the_page_and_those_not_found_are_not():
    def shares(found: bool) -> float:
        page = draw_scene_page("Scene 1", "", *frame_and_observation(found=found))
        return float((page == picture.QUALITY_STOPS[2]).all(axis=2).mean())

    assert shares(found=True) > 4 * shares(found=False)


@pytest.mark.parametrize("size", [(64, 48), (848, 480), (48, 64), (1280, 720)])
def test_a_page_fits_pictures_of_any_size(size):
    page = draw_scene_page("Scene 1", "", *frame_and_observation(*size))
    assert page.shape[0] >= HEADER + 2 * round(PANEL_WIDTH * size[1] / size[0])
    assert page.dtype == np.uint8


def test_a_frame_without_truth_and_an_observation_without_heatmaps_make_a_page_too():
    frame, observation = frame_and_observation()
    bare = Frame(rgb=frame.rgb, depth=frame.depth, camera=frame.camera)
    seen = {name: getattr(observation, name) for name in ("keypoints", "points", "mass", "height", "distance")}
    without = PoseEstimate(**seen, quality=observation.quality, filter=observation.filter)
    assert draw_scene_page("Scene 1", "", bare, without).any()


def test_an_observation_in_metres_has_two_columns_more():
    frame, observation = frame_and_observation()
    metres = replace(observation, expected_error=np.full(18, 0.1), radius=np.full(18, 0.25))
    plain, wider = (draw_scene_page("Scene 1", "", frame, one) for one in (observation, metres))
    assert wider.shape[1] == plain.shape[1] + METRES_WIDTH
    unlocated = replace(metres, expected_error=np.full(18, np.nan), radius=np.full(18, np.nan))
    assert (draw_scene_page("Scene 1", "", frame, unlocated) != wider).any()


def test_an_inferred_joint_is_marked_in_the_table_and_has_its_metres():
    frame, observation = frame_and_observation()
    metres = replace(observation, expected_error=np.full(18, 0.1), radius=np.full(18, 0.25))
    keypoints, nowhere = observation.keypoints.copy(), observation.points.copy()
    keypoints[4], nowhere[4] = np.nan, np.nan
    seen, inferred = (
        draw_scene_page("Scene 1", "", frame, one) for one in (metres, replace(metres, keypoints=keypoints))
    )
    not_found = draw_scene_page("Scene 1", "", frame, replace(metres, keypoints=keypoints, points=nowhere))
    # The fifth joint's row, from its mass to its quality and from its error on.
    right = MARGIN + 2 * PANEL_WIDTH + 2 * GAP + BAR_COLUMN
    row = slice(HEADER + CAPTION // 2 + 5 * ROW - 8, HEADER + CAPTION // 2 + 5 * ROW + 8)
    words, metre_columns = slice(right + 130, right + 390), slice(right + 400, right + 540)
    assert (seen[row, metre_columns] == inferred[row, metre_columns]).all()
    assert (seen[row, words] != inferred[row, words]).any()
    assert (not_found[row, words] != inferred[row, words]).any()


def test_a_page_without_truth_of_whom_nobody_found_can_be_drawn():
    frame, observation = frame_and_observation(found=False)
    bare = Frame(rgb=frame.rgb, depth=frame.depth, camera=frame.camera)
    nobody = replace(observation, points=np.full((18, 3), np.nan))
    assert (
        draw_scene_page("Scene 1", "", bare, nobody).shape == draw_scene_page("Scene 1", "", frame, observation).shape
    )


def test_joints_outside_of_the_pictures_are_counted():
    frame, observation = frame_and_observation()
    points = observation.points.copy()
    points[4] -= (7.0, 0.0, 0.0)
    person = person_in_space(frame, replace(observation, points=points))
    volume = volume_around(person.all_points(), 600, 560)
    assert space_words(person, volume).endswith(" 1 joint lies outside of the pictures.")
    whole = person_in_space(frame, observation)
    assert space_words(whole, volume_around(whole.all_points(), 600, 560)) == whole.in_words()


def test_depth_ticks_are_round_distances_that_can_be_read_apart():
    ticks = depth_ticks(DepthScale(1.9, 12.0))
    assert [metres for metres, _ in ticks] == [2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0]
    shares = [share for _, share in ticks]
    assert all(first - second >= 0.05 for first, second in pairwise(shares))
