import math

import numpy as np
import pytest

from protocol.scene import Arm, Leg
from render_worker.people.limbs import elevation, inward, mirrored, on_side, reach, shin_pitch
from render_worker.people.wide_poses import sample_wide_pose


def test_an_arm_goes_where_it_is_told():
    arm = reach(np.random.default_rng(0), out=(90, 90), up=(30, 30), length=(0.8, 0.8), swivel=(0.2, 0.2))
    assert arm.wrist == pytest.approx((0, 0.8 * math.cos(math.pi / 6), 0.4))
    assert arm.swivel == 0.2
    assert elevation(arm) == pytest.approx(math.pi / 6)


def test_inward_is_towards_the_other_shoulder():
    assert inward(Arm((0.5, -0.3, 0.0)), 1) == 0.3
    assert inward(Arm((0.5, -0.3, 0.0)), -1) == -0.3
    assert inward(on_side(Arm((0.5, -0.3, 0.0)), -1), -1) == 0.3


def test_the_shin_of_a_seat_is_upright():
    assert shin_pitch(Leg(flexion=1.5, knee=1.5)) == 0


def test_the_mirror_image_of_a_mirror_image_is_the_pose():
    pose = sample_wide_pose(np.random.default_rng(5))
    assert mirrored(pose) != pose
    assert mirrored(mirrored(pose)) == pose
