from functools import cache
from typing import get_args

import numpy as np
import pytest

from protocol.skeleton import Joint
from render_worker.people.body import pose_body
from render_worker.people.limbs import elevation, inward, shin_pitch
from render_worker.people.pose_families import LEAST_CROSSED, LEAST_KNEE, LEAST_OVERHEAD, Family, sample_family
from render_worker.people.wide_poses import is_wide

FAMILIES = get_args(Family)
FEET = ("foot", "toe")


def drawn(family: Family, count: int = 100):
    return [sample_family(family, np.random.default_rng(seed)) for seed in range(count)]


@pytest.fixture(scope="module")
def bodies(assets):
    """Bodies of a family, posed once for all tests."""
    return cache(
        lambda family: [pose_body(assets, 40 + seed % 20, pose) for seed, pose in enumerate(drawn(family, 12))]
    )


def lowest_of(assets, body, side, *bones):
    """The height of the lowest skin on a side that moves with bones, metres."""
    rig, skin = assets.rig, np.unique(assets.parts["skin"].source)
    columns = [n for n, label in enumerate(rig.labels) if label.startswith(bones) and label.endswith(side)]
    moved = rig.weights[np.ix_(skin, columns)].sum(axis=1) > 0.6
    return body.vertices[skin[moved], 2].min()


@pytest.mark.parametrize("family", FAMILIES)
def test_a_pose_is_drawn_the_same_from_the_same_seed_and_is_of_no_kind(family):
    assert drawn(family, 5) == drawn(family, 5)
    assert all(pose.kind == 0 for pose in drawn(family, 5))


@pytest.mark.parametrize("family", FAMILIES)
def test_training_never_draws_a_pose_of_a_family(family):
    assert not any(is_wide(pose) for pose in drawn(family))


@pytest.mark.parametrize("family", FAMILIES)
def test_the_lowest_skin_is_on_the_ground(assets, bodies, family):
    for body in bodies(family):
        assert body.vertices[assets.parts["skin"].source, 2].min() == pytest.approx(0, abs=0.01)


def test_overhead_an_arm_is_up_and_its_hand_above_the_head(bodies):
    raised = [sum(elevation(arm) >= LEAST_OVERHEAD for arm in (p.left_arm, p.right_arm)) for p in drawn("overhead")]
    assert set(raised) == {1, 2}
    for body in bodies("overhead"):
        eyes = body.joints[[Joint.LEFT_EYE, Joint.RIGHT_EYE], 2].max()
        assert body.joints[[Joint.LEFT_WRIST, Joint.RIGHT_WRIST], 2].max() > eyes


def test_crossed_both_wrists_are_on_the_other_side(bodies):
    for pose in drawn("crossed"):
        assert min(inward(pose.left_arm, 1), inward(pose.right_arm, -1)) >= LEAST_CROSSED
    for body in bodies("crossed"):
        left, right = (body.joints[wrist] - body.joints[Joint.NECK] for wrist in (Joint.LEFT_WRIST, Joint.RIGHT_WRIST))
        assert left[1] < right[1]
        # One forearm is before the other.
        assert abs(left[0] - right[0]) > 0.03


@pytest.mark.parametrize("family", ["squat", "kneel", "sit"])
def test_knees_are_bent_far(family):
    assert all(min(pose.left_leg.knee, pose.right_leg.knee) >= LEAST_KNEE for pose in drawn(family))


@pytest.mark.parametrize("family", ["squat", "sit"])
def test_who_squats_or_sits_has_both_feet_on_the_ground(assets, bodies, family):
    for body in bodies(family):
        assert max(lowest_of(assets, body, side, *FEET) for side in (".L", ".R")) < 0.02
        assert body.joints[[Joint.LEFT_HIP, Joint.RIGHT_HIP], 2].max() < 0.65


def test_who_kneels_has_a_knee_or_both_on_the_ground_and_both_feet(assets, bodies):
    on_both = [min(shin_pitch(p.left_leg), shin_pitch(p.right_leg)) > 1.7 for p in drawn("kneel")]
    assert 30 < sum(on_both) < 70
    for body in bodies("kneel"):
        knees = [lowest_of(assets, body, side, "upperleg", "lowerleg") for side in (".L", ".R")]
        assert min(knees) < 0.065
        assert max(lowest_of(assets, body, side, *FEET) for side in (".L", ".R")) < 0.065


def test_one_hand_is_up_left_and_right_about_as_often():
    left = [elevation(pose.left_arm) > elevation(pose.right_arm) for pose in drawn("overhead")]
    assert 30 < sum(left) < 70
