import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.camera import Camera, CameraPose, Intrinsics, back_project, project, world_to_camera

LEVEL = Camera(CameraPose((0.0, -2.0, 1.0), (0.0, 0.0, 1.0)), Intrinsics(640, 480, 400.0, 400.0, 319.5, 239.5))
"""Two metres south of the origin, one metre up, looking north."""

coordinates = st.floats(-5.0, 5.0)


def test_a_point_straight_ahead_is_in_the_middle_of_the_picture():
    assert project(np.array([[0.0, 0.0, 1.0]]), LEVEL) == pytest.approx(np.array([[319.5, 239.5, 2.0]]))


def test_right_of_the_camera_is_right_in_the_picture_and_above_is_above():
    # Half a metre at two metres' depth is 100 pixels of a focal length of 400.
    right, above = project(np.array([[0.5, 0.0, 1.0], [0.0, 0.0, 1.5]]), LEVEL)
    assert right == pytest.approx([419.5, 239.5, 2.0])
    assert above == pytest.approx([319.5, 139.5, 2.0])


def test_depth_is_along_the_view_not_along_the_ray():
    assert project(np.array([[2.0, 0.0, 1.0]]), LEVEL)[0, 2] == pytest.approx(2.0)


def test_behind_the_camera_depth_is_negative():
    assert project(np.array([[0.0, -5.0, 1.0]]), LEVEL)[0, 2] == pytest.approx(-3.0)


def test_what_is_not_located_stays_so():
    assert np.isnan(back_project(np.array([[np.nan, np.nan]]), np.array([np.nan]), LEVEL)).all()


@given(st.tuples(coordinates, coordinates, coordinates), st.tuples(coordinates, coordinates, coordinates))
def test_a_point_seen_is_the_point_that_it_was(eye, point):
    pose = CameraPose((eye[0] + 20.0, eye[1], eye[2]), (0.0, 0.0, 1.0))
    camera = Camera(pose, LEVEL.intrinsics)
    seen = project(np.array([point]), camera)
    assert back_project(seen[:, :2], seen[:, 2], camera) == pytest.approx(np.array([point]), abs=1e-9)


@given(st.tuples(coordinates, coordinates, coordinates))
def test_the_camera_turns_without_stretching(eye):
    rotation = world_to_camera(CameraPose((eye[0] + 20.0, eye[1], eye[2]), (0.0, 0.0, 1.0)))[:3, :3]
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_a_field_of_view_reaches_from_edge_to_edge():
    intrinsics = Intrinsics.from_horizontal_fov(640, 480, 90.0)
    # At 90 degrees half the picture's width is as far from the middle as the focal length.
    assert (intrinsics.fx, intrinsics.cx, intrinsics.cy) == pytest.approx((320.0, 319.5, 239.5))


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_camera_that_is_nowhere_is_refused(wrong):
    with pytest.raises(ValueError, match="finite"):
        CameraPose((wrong, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="finite"):
        Intrinsics(640, 480, 400.0, 400.0, wrong, 239.5)


def test_a_camera_can_not_look_straight_down():
    with pytest.raises(ValueError, match="straight"):
        CameraPose((1.0, 1.0, 3.0), (1.0, 1.0, 0.0))


@pytest.mark.parametrize(("width", "height"), [(0, 480), (640, -1), (8193, 480)])
def test_an_image_of_no_size_is_refused(width, height):
    with pytest.raises(ValueError, match="can't be made"):
        Intrinsics(width, height, 400.0, 400.0, 0.0, 0.0)
