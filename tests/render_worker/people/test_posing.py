import numpy as np
import pytest
from msgspec.structs import replace

from protocol.scene import Arm, BodyPose, Head, Leg, Trunk
from protocol.skeleton import Joint
from render_worker.people.body import pose_body

HANGING = BodyPose(0, Arm((0.15, 0.2, -0.93)), Arm((0.15, -0.2, -0.93)))
HIPS = [Joint.LEFT_HIP, Joint.RIGHT_HIP]
SHOULDERS = [Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]
LEGS = [*HIPS, Joint.LEFT_KNEE, Joint.RIGHT_KNEE, Joint.LEFT_ANKLE, Joint.RIGHT_ANKLE]


def joints_of(assets, identity=5, pose=HANGING, **changes):
    return pose_body(assets, identity, replace(pose, **changes)).joints


def across(joints):
    """From the right shoulder to the left one, as a unit vector."""
    line = joints[Joint.LEFT_SHOULDER] - joints[Joint.RIGHT_SHOULDER]
    return line / np.linalg.norm(line)


def test_a_bend_of_a_right_angle_brings_the_neck_before_the_hips_and_low(assets):
    upright, bent = joints_of(assets), joints_of(assets, trunk=Trunk(bend=np.pi / 2))
    hips = bent[HIPS].mean(axis=0)
    forward, _, up = bent[Joint.NECK] - hips
    assert forward > 0.3
    # The lower spine is still steep, so the neck is a little above the hips.
    assert up < 0.3 < (upright[Joint.NECK] - upright[HIPS].mean(axis=0))[2]
    # The head looks to the ground.
    ears = bent[[Joint.LEFT_EAR, Joint.RIGHT_EAR]].mean(axis=0)
    assert bent[Joint.NOSE, 2] < ears[2] - 0.05


def test_a_lean_to_the_left_brings_the_neck_to_the_left_and_the_left_shoulder_down(assets):
    leaning = joints_of(assets, trunk=Trunk(lean=0.4))
    assert leaning[Joint.NECK, 1] > 0.1
    assert leaning[Joint.LEFT_SHOULDER, 2] < leaning[Joint.RIGHT_SHOULDER, 2] - 0.1


@pytest.mark.parametrize("twist", [-0.6, 0.6])
def test_a_twist_turns_shoulders_and_head_to_the_left_and_leaves_the_neck_above_the_hips(assets, twist):
    ahead, twisted = joints_of(assets), joints_of(assets, trunk=Trunk(twist=twist))
    turned = np.arctan2(-across(twisted)[0], across(twisted)[1])
    assert turned == pytest.approx(twist, abs=0.02)
    np.testing.assert_allclose(twisted[Joint.NECK], ahead[Joint.NECK], atol=0.04)
    assert np.sign(twisted[Joint.NOSE, 1]) == np.sign(twist)


def test_a_turned_trunk_leaves_the_legs(assets):
    turned = joints_of(assets, trunk=Trunk(0.8, -0.3, 0.5))
    # A hip is a mean of vertices, some of which go with the spine.
    np.testing.assert_allclose(turned[LEGS], joints_of(assets)[LEGS], atol=0.03)


def test_arms_and_head_go_along_with_the_trunk(assets):
    pose = replace(HANGING, left_arm=Arm((0.7, 0.1, -0.1)), head=Head(0.2, 0.3))
    upright, turned = joints_of(assets, pose=pose), joints_of(assets, pose=pose, trunk=Trunk(0.7, 0.2, -0.4))
    for one, other in (
        (Joint.LEFT_SHOULDER, Joint.LEFT_WRIST),
        (Joint.RIGHT_SHOULDER, Joint.RIGHT_WRIST),
        (Joint.NECK, Joint.NOSE),
        (Joint.LEFT_WRIST, Joint.RIGHT_WRIST),
    ):
        before, after = (np.linalg.norm(joints[one] - joints[other]) for joints in (upright, turned))
        assert after == pytest.approx(before, abs=0.02)


def test_an_upright_trunk_is_no_trunk(assets):
    np.testing.assert_array_equal(joints_of(assets, trunk=Trunk()), joints_of(assets))


def lowest_of(assets, body, *bones):
    """The height of the lowest skin that moves with bones, metres."""
    rig, skin = assets.rig, np.unique(assets.parts["skin"].source)
    columns = [number for number, label in enumerate(rig.labels) if label.startswith(bones)]
    moved = rig.weights[np.ix_(skin, columns)].sum(axis=1) > 0.6
    return body.vertices[skin[moved], 2].min()


def test_a_foot_is_level_as_long_as_the_ankle_can_bend(assets):
    for flexion, knee in ((0.0, 0.0), (0.5, 1.0), (1.5, 1.5)):
        leg = Leg(flexion=flexion, knee=knee)
        body = pose_body(assets, 5, replace(HANGING, left_leg=leg, right_leg=leg))
        assert lowest_of(assets, body, "toe") == pytest.approx(0, abs=0.01)
        assert body.joints[Joint.LEFT_ANKLE, 2] < 0.12


@pytest.mark.parametrize("identity", [0, 23, 59])
def test_who_kneels_has_knees_and_toes_on_the_ground_and_the_heels_off_it(assets, identity):
    leg = Leg(knee=1.86)
    body = pose_body(assets, identity, replace(HANGING, left_leg=leg, right_leg=leg))
    assert lowest_of(assets, body, "upperleg", "lowerleg") == pytest.approx(0, abs=0.015)
    assert lowest_of(assets, body, "foot", "toe") == pytest.approx(0, abs=0.015)
    assert body.joints[Joint.LEFT_ANKLE, 2] > 0.15
