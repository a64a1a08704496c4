import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.scene import Arm
from render_worker.people.arm import STRAIGHTEST, RestArm, pose_arm

UPPER, LOWER = 0.30, 0.26


def rest_arm(side: int) -> RestArm:
    """An arm with its elbow bent, as every body has it at rest."""
    shoulder = np.array([0.0, 0.16 * side, 1.4])
    elbow = shoulder + UPPER * np.array([0.0, 0.6 * side, -0.8])
    wrist = elbow + LOWER * np.array([0.8, 0.36 * side, -0.48])
    return RestArm(shoulder, elbow, wrist, side)


def reach(rest: RestArm, arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Elbow and wrist from the posed shoulder."""
    posed = pose_arm(rest, arm)
    elbow = posed.upper @ (rest.elbow - rest.shoulder)
    return elbow, elbow + posed.lower @ (rest.wrist - rest.elbow)


directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(lambda v: np.linalg.norm(v) > 0.1)
sides = st.sampled_from([1, -1])


@given(directions, st.floats(0.3, 0.99), st.floats(-1.5, 1.5), sides)
def test_the_wrist_reaches_its_target(direction, length, swivel, side):
    rest = rest_arm(side)
    target = length * np.array(direction) / np.linalg.norm(direction)
    _, wrist = reach(rest, Arm(tuple(target), swivel))
    np.testing.assert_allclose(wrist, target * rest.length, atol=1e-9)


@given(directions, st.floats(0.0, 5.0), st.floats(-1.5, 1.5), sides)
def test_bones_keep_their_lengths_wherever_the_target_is(direction, length, swivel, side):
    rest = rest_arm(side)
    elbow, wrist = reach(rest, Arm(tuple(length * np.array(direction)), swivel))
    assert np.linalg.norm(elbow) == pytest.approx(UPPER)
    assert np.linalg.norm(wrist - elbow) == pytest.approx(LOWER)


def test_a_target_out_of_reach_is_pointed_at_with_a_nearly_straight_arm():
    rest = rest_arm(1)
    _, wrist = reach(rest, Arm((5.0, 0.0, 0.0)))
    np.testing.assert_allclose(wrist, (STRAIGHTEST * rest.length, 0, 0), atol=1e-9)


def test_the_elbow_of_an_arm_held_out_hangs_below_it():
    elbow, _ = reach(rest_arm(1), Arm((0.8, 0.0, 0.0)))
    assert elbow[2] < -0.05
    assert elbow[1] == pytest.approx(0, abs=1e-9)


def test_the_elbow_of_a_hanging_arm_points_backwards():
    elbow, _ = reach(rest_arm(1), Arm((0.0, 0.0, -0.9)))
    assert elbow[0] < -0.02


@pytest.mark.parametrize("side", [1, -1])
def test_a_positive_swivel_turns_the_elbow_outwards(side):
    elbow, _ = reach(rest_arm(side), Arm((0.8, 0.0, 0.0), swivel=0.6))
    assert elbow[1] * side > 0.03


def test_the_elbow_by_hand():
    # Upper arm 0.30 and forearm 0.26 to a wrist 0.40 in front: (0.09 - 0.0676 + 0.16) / 0.8 = 0.228 along,
    # and the square root of 0.09 - 0.228² = 0.195 below.
    rest = rest_arm(1)
    elbow, _ = reach(rest, Arm((0.40 / rest.length, 0.0, 0.0)))
    np.testing.assert_allclose(elbow, (0.228, 0.0, -0.19498), atol=1e-5)


def test_half_of_the_twist_stays_next_to_the_shoulder():
    rest = rest_arm(1)
    posed = pose_arm(rest, Arm((0.7, 0.0, 0.1), swivel=1.0))
    along = rest.elbow - rest.shoulder
    np.testing.assert_allclose(posed.upper_twist @ along, posed.upper @ along, atol=1e-9)
    whole = np.arccos((np.trace(posed.upper @ posed.girdle.T) - 1) / 2)
    half = np.arccos((np.trace(posed.upper_twist @ posed.upper.T) - 1) / 2)
    assert 0 < half < whole
