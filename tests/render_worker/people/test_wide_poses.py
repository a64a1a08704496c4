import numpy as np
import pytest
from msgspec.structs import replace

from protocol.scene import UPRIGHT, BodyPose, Head
from protocol.skeleton import Joint
from render_worker.people.body import pose_body
from render_worker.people.limbs import elevation, inward
from render_worker.people.pose_families import LEAST_CROSSED, LEAST_KNEE, LEAST_OVERHEAD
from render_worker.people.wide_poses import (
    MOST_ACROSS,
    MOST_ELEVATION,
    MOST_HEAD_TURN,
    MOST_INWARD,
    MOST_KNEE,
    MOST_ONE_KNEE,
    sample_wide_pose,
)

DRAWN = [sample_wide_pose(np.random.default_rng(seed)) for seed in range(600)]


def arms(pose: BodyPose):
    return (pose.left_arm, 1), (pose.right_arm, -1)


def legs(pose: BodyPose):
    return pose.left_leg, pose.right_leg


def test_a_pose_is_drawn_the_same_from_the_same_seed():
    assert sample_wide_pose(np.random.default_rng(3)) == DRAWN[3] != DRAWN[4]


def test_the_limits_leave_a_gap_to_every_family():
    assert MOST_ELEVATION < LEAST_OVERHEAD - 0.15
    assert MOST_INWARD < LEAST_CROSSED - 0.1
    assert MOST_KNEE < LEAST_KNEE - 0.15


def test_no_arm_is_up_and_one_wrist_at_most_is_across_and_one_knee_bent_far():
    for pose in DRAWN:
        assert pose.kind == 0
        assert max(elevation(arm) for arm, _ in arms(pose)) <= MOST_ELEVATION
        one, other = sorted(inward(arm, side) for arm, side in arms(pose))
        assert one <= MOST_INWARD
        assert other <= MOST_ACROSS
        straighter, more_bent = sorted(leg.knee for leg in legs(pose))
        assert straighter <= MOST_KNEE
        assert more_bent <= MOST_ONE_KNEE


def test_one_wrist_is_as_far_across_and_one_knee_as_bent_as_both_of_a_family():
    assert max(inward(arm, side) for pose in DRAWN for arm, side in arms(pose)) > LEAST_CROSSED + 0.1
    assert max(leg.knee for pose in DRAWN for leg in legs(pose)) > LEAST_KNEE + 0.5


def test_poses_are_wide():
    bends, leans, twists = np.array([[p.trunk.bend, p.trunk.lean, p.trunk.twist] for p in DRAWN]).T
    assert bends.max() > 1.0
    assert np.ptp(leans) > 0.7
    assert np.ptp(twists) > 1.0
    turns = [pose.head.turn for pose in DRAWN]
    assert 1.0 < max(turns) <= MOST_HEAD_TURN
    assert -1.0 > min(turns) >= -MOST_HEAD_TURN
    assert max(min(leg.knee for leg in legs(pose)) for pose in DRAWN) > 1.0
    wrists = np.array([pose.left_arm.wrist for pose in DRAWN])
    # Ahead, to the side, behind; low, level and above the shoulder.
    assert wrists.max(axis=0) == pytest.approx((0.93, 0.93, 0.6), abs=0.05)
    assert wrists[:, 0].min() < -0.3


def test_left_and_right_are_drawn_alike():
    lower = [pose.left_arm.wrist[2] < pose.right_arm.wrist[2] for pose in DRAWN]
    assert 250 < sum(lower) < 350


def test_bodies_keep_to_what_the_limits_are_for(assets):
    for seed in range(0, 300, 5):
        pose = replace(DRAWN[seed], trunk=UPRIGHT, head=Head())
        joints = pose_body(assets, seed % 40, pose).joints
        for wrist, arm, side in ((Joint.LEFT_WRIST, pose.left_arm, 1), (Joint.RIGHT_WRIST, pose.right_arm, -1)):
            x, y, _ = joints[wrist]
            assert side * y > 0 or inward(arm, side) > MOST_INWARD
            # As of the eight kinds: no hand is inside the trunk.
            assert abs(y) > 0.16 or x > 0.15


def test_people_stand_on_the_ground(assets):
    for seed in range(0, 60, 5):
        body = pose_body(assets, seed % 40, DRAWN[seed])
        assert body.vertices[assets.parts["skin"].source, 2].min() == pytest.approx(0, abs=1e-5)
        assert body.joints[[Joint.LEFT_ANKLE, Joint.RIGHT_ANKLE], 2].min() < 0.2  # Who crouches may lift the heels.
