import numpy as np
import pytest

from protocol.scene import Arm, BodyPose, Head, Leg
from protocol.skeleton import Joint
from render_worker.people.body import pose_body
from render_worker.people.poses import sample_pose

HANGING = BodyPose(0, Arm((0.15, 0.2, -0.93)), Arm((0.15, -0.2, -0.93)))
BONES = (
    (Joint.NECK, Joint.LEFT_SHOULDER, 0.15),
    (Joint.NECK, Joint.RIGHT_SHOULDER, 0.15),
    (Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW, 0.25),
    (Joint.RIGHT_SHOULDER, Joint.RIGHT_ELBOW, 0.25),
    (Joint.LEFT_ELBOW, Joint.LEFT_WRIST, 0.25),
    (Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST, 0.25),
)


@pytest.mark.parametrize("identity", [0, 21, 59])
def test_a_person_stands_on_the_ground_over_the_origin(assets, identity):
    body = pose_body(assets, identity, HANGING)
    skin = body.vertices[assets.parts["skin"].source]
    assert skin[:, 2].min() == pytest.approx(0, abs=1e-6)
    hips = body.joints[[Joint.LEFT_HIP, Joint.RIGHT_HIP], :2].mean(axis=0)
    np.testing.assert_allclose(hips, 0, atol=0.04)


def test_left_is_left_and_front_is_front(assets):
    body = pose_body(assets, 3, HANGING)
    for joint in Joint:
        if joint.name.startswith("LEFT"):
            assert body.joints[joint, 1] > 0
        if joint.name.startswith("RIGHT"):
            assert body.joints[joint, 1] < 0
    assert body.joints[Joint.NOSE, 0] > body.joints[Joint.LEFT_EAR, 0] + 0.05
    assert body.joints[Joint.NOSE, 2] > body.joints[Joint.NECK, 2] > body.joints[Joint.LEFT_HIP, 2]


def test_the_neck_is_the_middle_of_the_shoulders(assets):
    joints = pose_body(assets, 3, HANGING).joints
    np.testing.assert_allclose(
        joints[Joint.NECK], joints[[Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]].mean(0), atol=1e-6
    )


def test_the_wrist_joint_comes_near_the_wrist_target(assets):
    pose = BodyPose(1, Arm((0.8, 0.1, -0.1)), HANGING.right_arm)
    joints = pose_body(assets, 11, pose).joints
    length = np.linalg.norm(joints[Joint.LEFT_ELBOW] - joints[Joint.LEFT_SHOULDER])
    length += np.linalg.norm(joints[Joint.LEFT_WRIST] - joints[Joint.LEFT_ELBOW])
    reached = (joints[Joint.LEFT_WRIST] - joints[Joint.LEFT_SHOULDER]) / length
    np.testing.assert_allclose(reached, (0.8, 0.1, -0.1), atol=0.08)


def test_identities_are_adults_with_the_bones_that_the_quality_rules_suppose(assets):
    for identity in range(0, 60, 6):
        joints = pose_body(assets, identity, HANGING).joints
        assert 1.42 < joints[Joint.NOSE, 2] < 1.80
        for a, b, shortest in BONES:
            assert np.linalg.norm(joints[a] - joints[b]) > shortest - 0.01, (identity, a, b)


def test_a_raised_thigh_brings_the_knee_to_the_front_and_the_foot_stays_level(assets):
    standing = pose_body(assets, 5, HANGING).joints
    pose = BodyPose(5, HANGING.left_arm, HANGING.right_arm, left_leg=Leg(flexion=0.5, knee=0.5))
    stepping = pose_body(assets, 5, pose).joints
    assert stepping[Joint.LEFT_KNEE, 0] > standing[Joint.LEFT_KNEE, 0] + 0.1
    assert stepping[Joint.LEFT_ANKLE, 2] > standing[Joint.LEFT_ANKLE, 2] + 0.02


def test_the_head_nods_down_and_turns_to_the_left(assets):
    ahead = pose_body(assets, 5, HANGING).joints[Joint.NOSE]
    arms = HANGING.left_arm, HANGING.right_arm
    nodding = pose_body(assets, 5, BodyPose(0, *arms, head=Head(pitch=0.4))).joints[Joint.NOSE]
    turning = pose_body(assets, 5, BodyPose(0, *arms, head=Head(turn=0.5))).joints[Joint.NOSE]
    assert nodding[2] < ahead[2] - 0.02
    assert turning[1] > ahead[1] + 0.03


def test_fingers_curl_towards_the_palm(assets):
    # With the arm hanging, palms look to the thighs, so curled finger tips are nearer to the middle than knuckles.
    body = pose_body(assets, 5, HANGING)
    index = assets.rig.labels.index
    for side, sign in (("L", 1), ("R", -1)):
        tip = body.vertices[assets.rig.weights[:, index(f"finger3-3.{side}")] > 0.5].mean(axis=0)
        knuckle = body.vertices[assets.rig.weights[:, index(f"finger3-1.{side}")] > 0.5].mean(axis=0)
        wrist = body.joints[Joint.LEFT_WRIST if side == "L" else Joint.RIGHT_WRIST]
        straight = (knuckle - wrist) / np.linalg.norm(knuckle - wrist)
        bent = tip - knuckle
        aside = bent - (bent @ straight) * straight
        assert aside[1] * sign < -0.005


@pytest.mark.parametrize("kind", range(8))
def test_no_hand_is_inside_the_trunk(assets, kind):
    # A third of the hips' breadth from the middle and 15 cm before and behind it is trunk on every body.
    for seed in range(6):
        joints = pose_body(assets, 9 * seed + 1, sample_pose(kind, np.random.default_rng(seed))).joints
        for wrist in (Joint.LEFT_WRIST, Joint.RIGHT_WRIST):
            x, y, _ = joints[wrist]
            assert abs(y) > 0.16 or x > 0.15
