import numpy as np
import pytest

from protocol.skeleton import JOINT_COUNT, LIMBS, Joint, upper_body_weights, weighted_uncertainty


def test_certainty_of_every_joint_is_no_uncertainty():
    assert weighted_uncertainty(np.ones(JOINT_COUNT)) == 0.0


def test_nobody_found_is_an_uncertainty_of_ten():
    assert weighted_uncertainty(np.zeros(JOINT_COUNT)) == pytest.approx(10.0)


def test_the_face_weighs_most():
    # A nose of quality 0.5 and a missing left wrist: 2 · 0.5 + 0.5 · 1.
    quality = np.ones(JOINT_COUNT)
    quality[Joint.NOSE], quality[Joint.LEFT_WRIST] = 0.5, 0.0
    assert weighted_uncertainty(quality) == pytest.approx(1.5)


def test_legs_and_ears_do_not_count():
    weights = upper_body_weights()
    lower = [joint for joint in Joint if any(part in joint.name for part in ("HIP", "KNEE", "ANKLE", "EAR"))]
    assert weights[lower].sum() == 0.0


def test_every_limb_joins_joints_of_one_side_or_the_middle():
    for start, end in LIMBS:
        sides = {joint.name.split("_")[0] for joint in (start, end)} & {"LEFT", "RIGHT"}
        assert len(sides) <= 1
    assert {joint for limb in LIMBS for joint in limb} == set(Joint)
