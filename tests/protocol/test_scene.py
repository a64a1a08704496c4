import math

import msgspec
import pytest
from msgspec.structs import replace

from protocol.scene import (
    MOST_BYSTANDERS,
    TEST_IDENTITIES,
    TEST_POSES,
    TRAIN_IDENTITIES,
    TRAIN_POSES,
    Arm,
    BodyPose,
    Figure,
    Head,
    Leg,
    Scene,
    Sun,
    Trunk,
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


BYSTANDER = Figure(1, STANDING, 0, (1.0, 0.0), 0.0)


def test_the_person_is_whom_the_scene_is_about_and_no_bystander():
    assert replace(scene(identity=7, yaw=0.5), bystanders=(BYSTANDER,)).person == replace(
        BYSTANDER, identity=7, position=(0.0, 0.0), yaw=0.5
    )


def test_bystanders_are_held_to_what_the_person_is():
    with pytest.raises(ValueError, match="0 to 59"):
        replace(BYSTANDER, identity=60)
    with pytest.raises(ValueError, match="finite"):
        replace(BYSTANDER, position=(math.inf, 0.0))


def test_a_crowd_is_refused():
    replace(scene(), bystanders=(BYSTANDER,) * MOST_BYSTANDERS)
    with pytest.raises(ValueError, match="9 bystanders are a crowd"):
        replace(scene(), bystanders=(BYSTANDER,) * (MOST_BYSTANDERS + 1))


def test_a_scene_without_bystanders_is_encoded_as_it_was_before_there_were_any():
    # The bytes seed the noise of depth, and an older worker's answer must stay the same.
    assert "bystanders" not in msgspec.to_builtins(scene())
    encoded = msgspec.msgpack.encode(scene())
    assert msgspec.msgpack.decode(encoded, type=Scene) == scene()
    assert msgspec.msgpack.encode(msgspec.msgpack.decode(encoded, type=Scene)) == encoded
    crowded = replace(scene(), bystanders=(BYSTANDER,))
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(crowded), type=Scene) == crowded


def test_an_upright_pose_is_encoded_as_it_was_before_there_was_a_trunk():
    # The bytes seed the noise of depth, so legs and head stay in them, at rest or not.
    assert list(msgspec.to_builtins(STANDING)) == ["kind", "left_arm", "right_arm", "left_leg", "right_leg", "head"]
    encoded = msgspec.msgpack.encode(STANDING)
    assert msgspec.msgpack.encode(msgspec.msgpack.decode(encoded, type=BodyPose)) == encoded
    assert msgspec.msgpack.encode(replace(STANDING, left_leg=Leg(), head=Head(), trunk=Trunk(0.0, 0.0, 0.0))) == encoded


def test_a_trunk_that_is_sent_as_upright_is_the_same_pose_in_the_same_bytes():
    sent = msgspec.msgpack.encode({**msgspec.to_builtins(STANDING), "trunk": {"bend": 0.0}})
    assert msgspec.msgpack.encode(msgspec.msgpack.decode(sent, type=BodyPose)) == msgspec.msgpack.encode(STANDING)


def test_a_turned_trunk_travels():
    bent = replace(STANDING, trunk=Trunk(bend=0.5, lean=-0.1, twist=0.2))
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(bent), type=BodyPose) == bent
