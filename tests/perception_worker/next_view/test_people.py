import numpy as np
import pytest

from perception_worker.next_view.people import lifted_joints, person_frame
from tests.perception_worker.lifter.bodies import CAMERA, INTRINSICS, lifter, picture
from tests.perception_worker.next_view.scenes import BODY, arrays_of, turned


def test_a_frame_has_the_person_at_its_origin_and_their_front_along_x():
    joints = turned(BODY, np.pi / 2) + np.array([3.0, 5.0, 0.0])
    frame = person_frame(joints, np.zeros(2))
    assert bool(frame.found)
    assert float(frame.yaw) == pytest.approx(np.pi / 2)
    assert frame.place == pytest.approx([3.0, 5.0])
    # Two metres north of them is two metres ahead; a metre east is at their right.
    seen = frame.local(np.array([[3.0, 7.0, 1.5], [4.0, 5.0, 0.0]]))
    assert seen == pytest.approx(np.array([[2.0, 0.0, 1.5], [0.0, -1.0, 0.0]]))


def test_a_pose_is_the_same_wherever_a_person_stands_and_faces():
    yaws = np.array([0.3, -2.0, 3.1])
    joints = np.stack([turned(BODY, yaw) + np.array([yaw, 2.0 * yaw, 0.0]) for yaw in yaws])
    frame = person_frame(joints, np.zeros((3, 2)))
    assert frame.yaw == pytest.approx(yaws)
    assert frame.local(joints) == pytest.approx(np.stack([BODY] * 3), abs=1e-9)


def test_a_person_who_is_not_found_stands_where_expected_and_faces_along_x():
    frame = person_frame(np.full((18, 3), np.nan), np.array([1.0, 2.0]))
    assert not frame.found
    assert frame.local(np.array([[1.5, 2.0, 0.7]])) == pytest.approx(np.array([[0.5, 0.0, 0.7]]))


def test_views_are_lifted_as_one_by_one_and_those_without_a_person_to_none():
    arrays, own = arrays_of(2), lifter()
    keypoints, height, evidence, _ = picture()
    arrays.keypoints[1, 4], arrays.height[1, 4] = keypoints, height
    arrays.narrow[1, 4], arrays.wide[1, 4] = evidence.narrow, evidence.wide
    arrays.position[1, 4], arrays.target[1, 4] = CAMERA.pose.position, CAMERA.pose.target
    arrays.intrinsics[1, 4] = INTRINSICS.fx, INTRINSICS.fy, INTRINSICS.cx, INTRINSICS.cy
    joints = lifted_joints(arrays, own)
    assert joints.shape == (2, 9, 18, 3)
    assert joints[1, 4] == pytest.approx(own.lift(keypoints, height, evidence, CAMERA).points, abs=1e-6)
    assert np.isfinite(joints).sum() == 18 * 3


def test_scenes_without_any_person_are_lifted_to_nothing():
    assert np.isnan(lifted_joints(arrays_of(1), lifter())).all()
