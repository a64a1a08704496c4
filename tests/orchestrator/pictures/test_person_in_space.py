import math

import numpy as np
import pytest

from orchestrator.pictures.person_in_space import PersonInSpace, Standing, facing, person_in_space, standing_of
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import Frame
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.skeleton import Joint

CAMERA = Camera(CameraPose((1.0, 5.0, 1.5), (1.0, 2.0, 1.2)), Intrinsics.from_horizontal_fov(64, 48, 70.0))


def body(yaw: float = 0.0) -> np.ndarray:
    """(18, 3) world joints of somebody at (1, 2) whose shoulders are 0.4 m apart."""
    joints = np.tile((1.0, 2.0, 1.0), (18, 1))
    left = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
    joints[Joint.LEFT_SHOULDER] += 0.2 * left
    joints[Joint.RIGHT_SHOULDER] -= 0.2 * left
    return joints


def nowhere(*columns: int) -> np.ndarray:
    return np.full((18, *columns), np.nan)


def seen(points: np.ndarray, keypoints: np.ndarray | None = None, truth: np.ndarray | None = None) -> PersonInSpace:
    frame = Frame(rgb=np.zeros((48, 64, 3), np.uint8), depth=np.ones((48, 64), np.float32), camera=CAMERA, joints=truth)
    unsure = {name: np.zeros(18) for name in ("mass", "height", "distance", "quality")}
    where = np.zeros((18, 2)) if keypoints is None else keypoints
    return person_in_space(frame, PoseEstimate(keypoints=where, points=points, filter=FilterState.initial(), **unsure))


@pytest.mark.parametrize("yaw", [0.0, 1.0, math.pi / 2, -2.5])
def test_who_has_a_left_and_a_right_shoulder_faces_at_a_right_angle_to_them(yaw):
    assert facing(body(yaw)) == pytest.approx(yaw)


def test_who_has_no_shoulder_located_faces_the_camera():
    points = body()
    points[Joint.LEFT_SHOULDER] = np.nan
    assert facing(points) is None
    assert standing_of(points, CAMERA.pose).yaw == pytest.approx(math.pi / 2)


def test_a_yaw_that_is_told_counts_before_the_shoulders():
    assert standing_of(body(1.0), CAMERA.pose, yaw=0.3).yaw == 0.3


def test_who_is_not_located_at_all_stands_where_the_camera_looks():
    assert standing_of(nowhere(3), CAMERA.pose) == Standing((1.0, 2.0), pytest.approx(math.pi / 2))


def test_in_a_persons_frame_x_is_to_their_front_and_y_to_their_left():
    standing = Standing((1.0, 2.0), math.pi / 2)
    front, left, above = standing.turned(np.array([[1.0, 3.0, 0.0], [0.0, 2.0, 0.0], [1.0, 2.0, 1.7]]))
    assert front == pytest.approx((1.0, 0.0, 0.0))
    assert left == pytest.approx((0.0, 1.0, 0.0))
    assert above == pytest.approx((0.0, 0.0, 1.7))


def test_estimate_truth_and_camera_are_in_the_frame_of_the_true_person():
    person = seen(body(0.0) + np.array([0.0, 0.0, 0.1]), truth=body(math.pi / 2))
    assert person.truth is not None
    assert person.truth[Joint.LEFT_SHOULDER] == pytest.approx((0.0, 0.2, 1.0))
    assert person.points[Joint.LEFT_SHOULDER] == pytest.approx((0.2, 0.0, 1.1))
    assert person.camera[0] == pytest.approx((3.0, 0.0, 1.5))


def test_the_mean_error_is_told_of_seen_and_of_inferred_joints():
    truth, keypoints = body(), np.zeros((18, 2))
    points = truth + np.array([0.03, 0.0, 0.0])
    keypoints[Joint.NOSE] = np.nan
    points[Joint.NOSE] = truth[Joint.NOSE] + (0.0, 0.0, 0.2)
    words = seen(points, keypoints, truth).in_words()
    assert words == "Mean error: 0.030 m of 17 seen joints; 0.200 m of 1 inferred joint."


def test_where_the_truth_is_not_known_joints_are_counted():
    points = body()
    points[Joint.NOSE] = np.nan
    assert seen(points).in_words() == "17 seen joints; no inferred joints."


def test_who_is_not_found_and_who_is_not_located_are_told_apart():
    assert seen(nowhere(3), nowhere(2), body()).in_words() == "No person was found."
    assert seen(nowhere(3), truth=body()).in_words() == "No joint was located."
