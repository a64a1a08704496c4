"""A person who stands at (1, 2) and faces a yaw, with the joints of the tests' body."""

import math

import numpy as np
import pytest

from agent.environment.v1.person import Person
from protocol.skeleton import Joint
from tests.agent.analytic_sensor import BODY

PLACE = (1.0, 2.0)
ALL = np.ones(18, bool)


def person(yaw: float = 0.0, seen: np.ndarray = ALL, **moved: tuple[float, float, float]) -> Person:
    """A person; joints that are `moved` are there in the body's frame."""
    body = BODY.copy()
    for name, point in moved.items():
        body[Joint[name.upper()]] = point
    cosine, sine = math.cos(yaw), math.sin(yaw)
    joints = body @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]).T
    return Person(joints + np.array([*PLACE, 0.0]), seen)


def all_but(*joints: Joint) -> np.ndarray:
    seen = ALL.copy()
    seen[list(joints)] = False
    return seen


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.5, -1.9])
def test_they_face_their_yaw_and_stand_where_they_stand(yaw: float) -> None:
    one = person(yaw)
    assert one.facing == pytest.approx((math.cos(yaw), math.sin(yaw)))
    assert one.place == pytest.approx(PLACE, abs=0.02)
    x, y, z = one.front_point(2.5, 1.6) or (0.0, 0.0, 0.0)
    assert (x, y, z) == pytest.approx((1.0 + 2.5 * math.cos(yaw), 2.0 + 2.5 * math.sin(yaw), 1.6), abs=0.02)


def test_shoulders_or_hips_are_enough_to_know_where_they_face() -> None:
    assert person(0.7, all_but(Joint.LEFT_SHOULDER)).facing == pytest.approx((math.cos(0.7), math.sin(0.7)))
    assert person(0.7, all_but(Joint.RIGHT_HIP)).facing == pytest.approx((math.cos(0.7), math.sin(0.7)))


def test_before_both_sides_were_seen_nothing_is_known_of_their_front() -> None:
    one = person(0.7, all_but(Joint.LEFT_SHOULDER, Joint.RIGHT_HIP))
    assert one.place is not None
    assert (one.facing, one.front_point(2.5, 1.6)) == (None, None)


def test_nobody_is_nowhere() -> None:
    one = person(seen=np.zeros(18, bool))
    assert (one.place, one.facing, one.front_point(2.5, 1.6)) == (None, None, None)
    assert one.handover_wrist((5.0, 5.0, 1.6)) in (Joint.LEFT_WRIST, Joint.RIGHT_WRIST)


@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_the_hand_that_is_held_out_is_offered_wherever_the_drone_is(yaw: float) -> None:
    one = person(yaw, left_wrist=(0.45, 0.2, 1.2))
    for drone in ((4.0, 2.0, 1.6), (-2.0, 2.0, 1.6), (1.0, -3.0, 1.6)):
        assert one.handover_wrist(drone) is Joint.LEFT_WRIST


def test_of_two_hands_that_are_held_out_the_farther_one_is_offered() -> None:
    one = person(left_wrist=(0.35, 0.2, 1.2), right_wrist=(0.5, -0.2, 1.2))
    assert one.handover_wrist((1.0, 6.0, 1.6)) is Joint.RIGHT_WRIST


def test_where_none_is_held_out_the_nearer_one_is_taken() -> None:
    assert person().handover_wrist((1.0, 6.0, 1.6)) is Joint.LEFT_WRIST
    assert person().handover_wrist((1.0, -6.0, 1.6)) is Joint.RIGHT_WRIST


def test_a_wrist_that_was_never_seen_is_taken_last() -> None:
    one = person(seen=all_but(Joint.LEFT_WRIST), left_wrist=(0.45, 0.2, 1.2))
    assert one.handover_wrist((1.0, 6.0, 1.6)) is Joint.RIGHT_WRIST
