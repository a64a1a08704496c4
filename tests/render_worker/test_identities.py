import numpy as np
import pytest

from protocol.skeleton import Joint
from render_worker.baking.anny_bodies import RestBody
from render_worker.baking.identities import choose_identities, is_adult


def body(*, nose: float = 1.6, forearm: float = 0.26, half_shoulder: float = 0.17) -> RestBody:
    joints = np.zeros((18, 3))
    joints[Joint.NOSE] = (0.1, 0, nose)
    for side, names in ((1, "LEFT"), (-1, "RIGHT")):
        joints[Joint[f"{names}_SHOULDER"]] = (0, side * half_shoulder, 1.4)
        joints[Joint[f"{names}_ELBOW"]] = (0, side * half_shoulder, 1.1)
        joints[Joint[f"{names}_WRIST"]] = (forearm, side * half_shoulder, 1.1)
    joints[Joint.NECK] = (0, 0, 1.4)
    return RestBody(np.array([[0.0, 0, 0], [0, 0, 1.75]]), np.zeros((1, 3)), joints)


def test_an_adult_of_usual_measures_is_one():
    assert is_adult(body())


@pytest.mark.parametrize(
    "measures", [{"nose": 1.30}, {"nose": 1.85}, {"forearm": 0.24}, {"half_shoulder": 0.14}, {"forearm": 0.2505}]
)
def test_a_child_a_giant_and_a_short_bone_are_refused(measures):
    assert not is_adult(body(**measures))


def test_women_and_men_come_by_turns_and_differ_from_each_other():
    chosen = choose_identities(lambda _: body(), count=12)
    assert [phenotype["gender"] > 0.5 for phenotype in chosen] == [True, False] * 6
    assert len({tuple(phenotype.values()) for phenotype in chosen}) == 12
    assert all(phenotype["age"] >= 0.67 for phenotype in chosen)


def test_weights_are_spread_over_their_whole_range():
    weights = sorted(phenotype["weight"] for phenotype in choose_identities(lambda _: body(), count=20))
    assert weights[0] < 0.25
    assert weights[-1] > 0.75
    assert np.diff(weights).max() < 0.12


def test_refused_bodies_are_passed_over():
    tall_ones = choose_identities(lambda phenotype: body(nose=1.3 + phenotype["height"]), count=10)
    assert all(phenotype["height"] < 0.5 for phenotype in tall_ones)
