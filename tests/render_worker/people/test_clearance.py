import pytest

from protocol.scene import Arm
from render_worker.people.clearance import is_clear


@pytest.mark.parametrize(
    "wrist", [(0.15, 0.2, -0.93), (0.8, 0.0, 0.0), (0.5, 0.0, -0.3), (0.0, 0.9, 0.0), (0.1, 0.2, 0.9)]
)
def test_arms_that_hang_reach_out_or_go_up_are_clear(wrist):
    x, y, z = wrist
    assert is_clear(Arm((x, y, z)), 1)
    assert is_clear(Arm((x, -y, z)), -1)


@pytest.mark.parametrize("wrist", [(0.1, -0.3, -0.6), (0.0, -0.2, -0.9), (0.1, -0.3, 0.4)])
def test_a_hand_in_the_belly_the_hip_or_the_head_is_not(wrist):
    assert not is_clear(Arm(wrist), 1)


def test_an_elbow_in_the_trunk_is_not_clear_though_the_hand_is():
    hand = (0.42, -0.45, -0.35)
    assert is_clear(Arm(hand, swivel=1.1), 1)
    assert not is_clear(Arm(hand, swivel=0.1), 1)
