import math

import pytest

from protocol.scene import (
    TEST_IDENTITIES,
    TEST_POSES,
    TRAIN_IDENTITIES,
    TRAIN_POSES,
    Arm,
    BodyPose,
    Scene,
    Sun,
)

STANDING = BodyPose(kind=0, left_arm=Arm((0.0, 0.1, -0.9)), right_arm=Arm((0.0, -0.1, -0.9)))


def scene(identity: int = 0, yaw: float = 0.0) -> Scene:
    return Scene(identity, STANDING, 0, (0.0, 0.0), yaw, Sun(0.0, 1.0), "grass", "hills")


def test_a_person_of_a_quarter_turn_faces_north():
    assert scene(yaw=math.pi / 2).facing == pytest.approx((0.0, 1.0))


def test_nobody_is_met_in_training_and_in_test():
    assert set(TRAIN_IDENTITIES).isdisjoint(TEST_IDENTITIES)
    assert len(TRAIN_IDENTITIES) + len(TEST_IDENTITIES) == 60


def test_two_poses_are_never_seen_in_training():
    assert set(TEST_POSES) - set(TRAIN_POSES) == {6, 7}


def test_an_unknown_person_is_refused():
    with pytest.raises(ValueError, match="0 to 59"):
        scene(identity=60)


def test_a_person_who_faces_nowhere_is_refused():
    with pytest.raises(ValueError, match="finite"):
        scene(yaw=math.nan)
