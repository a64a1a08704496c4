import numpy as np
import pytest

from protocol.scene import BodyPose
from render_worker.people.poses import HANDOVER_POSES, sample_pose


def drawn(kind: int, count: int = 60) -> list[BodyPose]:
    return [sample_pose(kind, np.random.default_rng(seed)) for seed in range(count)]


@pytest.mark.parametrize("kind", range(8))
def test_a_pose_is_drawn_the_same_from_the_same_seed_and_keeps_its_kind(kind):
    first, second = sample_pose(kind, np.random.default_rng(3)), sample_pose(kind, np.random.default_rng(3))
    assert first == second
    assert first.kind == kind
    assert first != sample_pose(kind, np.random.default_rng(4))


@pytest.mark.parametrize("kind", range(8))
def test_no_wrist_is_farther_away_than_the_arm_is_long(kind):
    for pose in drawn(kind):
        for arm in (pose.left_arm, pose.right_arm):
            assert 0.5 < np.linalg.norm(arm.wrist) < 1


@pytest.mark.parametrize("kind", range(8))
def test_no_wrist_is_carried_through_the_trunk(kind):
    for pose in drawn(kind):
        assert pose.left_arm.wrist[1] > -0.15
        assert pose.right_arm.wrist[1] < 0.15


@pytest.mark.parametrize("kind", HANDOVER_POSES)
def test_in_a_handover_one_hand_is_held_out_and_the_other_hangs(kind):
    for pose in drawn(kind):
        forward = sorted(arm.wrist[0] for arm in (pose.left_arm, pose.right_arm))
        assert forward[1] > 0.35
        assert forward[0] < 0.35


@pytest.mark.parametrize("kind", [1, 3, 4, 6])
def test_a_hand_is_held_out_left_and_right_about_as_often(kind):
    held_out = [np.hypot(*pose.left_arm.wrist[:2]) > np.hypot(*pose.right_arm.wrist[:2]) for pose in drawn(kind)]
    assert 15 < sum(held_out) < 45
