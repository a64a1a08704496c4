import numpy as np
import pytest

from perception_worker.calibration.features import ABSENT, FEATURES, joint_features
from protocol.skeleton import Joint

CAMERA = (0.0, 0.0, 1.0)
ROOM = np.array([4.0, 0.0, 1.0])


def features(points, camera=CAMERA, **given):
    known = {name: np.full(18, 0.5) for name in ("mass", "height", "distance", "spread")} | given
    table = joint_features(points, camera=camera, **known)
    return {name: table[:, column] for column, name in enumerate(FEATURES)}


def body(**moved):
    """All joints at one place, 4 m in front of the camera, but for those that are moved by so much."""
    points = np.tile(ROOM, (18, 1))
    for name, by in moved.items():
        points[Joint[name.upper()]] += by
    return points


class TestColumns:
    def test_left_and_right_are_of_one_kind(self):
        kind = features(body())["kind"]
        assert kind[Joint.LEFT_WRIST] == kind[Joint.RIGHT_WRIST] != kind[Joint.LEFT_ELBOW]
        assert len(set(kind)) == 10

    def test_the_components_and_the_spread_are_passed_on(self):
        ramp = np.arange(18) / 32
        table = features(body(), mass=ramp, height=ramp + 1, distance=ramp + 2, spread=ramp + 3)
        for number, name in enumerate(("mass", "height", "distance", "spread")):
            assert table[name].tolist() == (ramp + number).tolist()

    def test_the_number_of_joints_that_were_detected(self):
        height = np.where(np.arange(18) < 5, 0.5, 0.0)
        assert set(features(body(), height=height)["found"]) == {5.0}

    def test_a_joint_behind_the_body_is_farther_than_its_middle(self):
        table = features(body(right_wrist=(3.0, 0.0, 0.0)))
        assert table["range"][[Joint.RIGHT_WRIST, Joint.NECK]] == pytest.approx([7.0, 4.0])
        assert table["depth_offset"][[Joint.RIGHT_WRIST, Joint.NECK]] == pytest.approx([3.0, 0.0])
        assert table["centre_offset"][[Joint.RIGHT_WRIST, Joint.NECK]] == pytest.approx([3.0, 0.0])

    def test_how_high_a_joint_is_above_the_middle(self):
        assert features(body(nose=(0.0, 0.0, 0.7)))["rise"][[Joint.NOSE, Joint.NECK]] == pytest.approx([0.7, 0.0])

    def test_the_bone_is_to_the_joint_that_it_hangs_on(self):
        height = np.zeros(18)
        height[Joint.RIGHT_ELBOW] = 0.8
        table = features(body(right_wrist=(0.3, 0.4, 0.0)), height=height)
        assert table["bone"][Joint.RIGHT_WRIST] == pytest.approx(0.5)
        assert table["bone_depth"][Joint.RIGHT_WRIST] == pytest.approx(np.hypot(4.3, 0.4) - 4)
        assert table["bone_height"][Joint.RIGHT_WRIST] == pytest.approx(0.8)
        assert table["bone"][Joint.RIGHT_ELBOW] == 0.0

    def test_the_pair_is_the_mirror_joint_and_the_neck_its_own(self):
        height = np.zeros(18)
        height[Joint.LEFT_HIP] = 0.6
        table = features(body(left_hip=(0.0, 0.3, 0.4)), height=height)
        assert table["pair"][[Joint.RIGHT_HIP, Joint.LEFT_HIP, Joint.NECK]] == pytest.approx([0.5, 0.5, 0.0])
        assert table["pair_height"][[Joint.RIGHT_HIP, Joint.LEFT_HIP]] == pytest.approx([0.6, 0.0])
        assert table["pair_depth"][Joint.LEFT_HIP] == pytest.approx(-table["pair_depth"][Joint.RIGHT_HIP])

    def test_who_faces_the_camera_has_the_left_side_to_the_camera_s_right(self):
        # The camera looks along x, so its right is -y.
        shoulders = {"left_shoulder": (0.0, -0.2, 0.0), "right_shoulder": (0.0, 0.2, 0.0)}
        table = features(body(**shoulders))
        assert table["shoulders"] == pytest.approx(np.full(18, 0.4))
        assert table["side"][[Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]] == pytest.approx([0.2, 0.2])
        from_behind = features(body(**shoulders), camera=(8.0, 0.0, 1.0))
        assert from_behind["shoulders"] == pytest.approx(np.full(18, -0.4))
        assert from_behind["side"][Joint.LEFT_SHOULDER] == pytest.approx(-0.2)
        assert features(body(left_hip=(0.0, -0.1, 0.0)))["hips"] == pytest.approx(np.full(18, 0.1), abs=1e-3)


class TestWhatIsMissing:
    def test_is_absent_and_never_nan(self):
        points = body()
        points[Joint.RIGHT_ELBOW] = np.nan
        table = features(points)
        assert table["bone"][Joint.RIGHT_WRIST] == ABSENT
        assert table["pair"][Joint.LEFT_ELBOW] == ABSENT
        assert all(np.isfinite(column).all() for column in table.values())

    def test_does_not_move_the_middle(self):
        points = body(nose=(0.0, 0.0, 0.7))
        points[10:] = np.nan
        assert features(points)["rise"][Joint.NOSE] == pytest.approx(0.7)


def test_turning_and_moving_the_world_changes_nothing():
    random = np.random.default_rng(3)
    points = ROOM + random.normal(scale=0.4, size=(18, 3))
    angle = 1.1
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    moved = np.array([5.0, -2.0, 0.0])
    there = features(points @ turn.T + moved, camera=tuple(turn @ CAMERA + moved))
    for name, column in features(points).items():
        assert there[name] == pytest.approx(column, abs=1e-5)


def test_straight_below_the_camera_has_no_side():
    table = features(np.tile([0.0, 0.0, 0.0], (18, 1)), camera=(0.0, 0.0, 3.0))
    assert not table["side"].any()
