import math

import numpy as np
import pytest

from orchestrator.experiments.figures.lifting_figures import LiftedJoints, lifted_joints
from orchestrator.experiments.figures.sample import Sample, samples_of
from orchestrator.experiments.pages.lifting_page import lifting_sections

NOSE, RIGHT_WRIST, LEFT_WRIST = 0, 4, 7
FAMILIES = ("overhead", "crossed", "squat", "kneel", "sit")


def two_frames() -> Sample:
    """Two people, near in kind 6 and far in kind 0; of both, the nose and a wrist are seen and the other wrist is not.

    The second one's right wrist is known to the lifter alone, and so are the 15 other joints: exactly, of the first.
    """
    detected = np.zeros((2, 18))
    detected[:, [NOSE, RIGHT_WRIST]] = 1
    error, radius = np.zeros((2, 18)), np.full((2, 18), 0.5)
    error[0, [NOSE, RIGHT_WRIST, LEFT_WRIST]] = 0.02, 0.20, 0.30
    radius[0, [NOSE, RIGHT_WRIST, LEFT_WRIST]] = 0.05, 0.10, 0.40
    error[1], radius[1] = np.nan, np.nan
    error[1, [NOSE, RIGHT_WRIST, LEFT_WRIST]] = 0.04, 0.10, 0.50
    radius[1, [NOSE, RIGHT_WRIST, LEFT_WRIST]] = 0.03, 0.30, 0.40
    columns = {
        "identity": np.array([40.0, 41.0]),
        "pose": np.array([6.0, 0.0]),
        "distance": np.array([2.0, 6.0]),
        "frame": np.array([0.0, 1.0]),
        "detected": detected,
        "error": error,
        "radius": radius,
    }
    for lifting, off in (("mean", 0.3), ("median", 0.2), ("nearest", 0.1)):
        surface = np.where(detected > 0, off, np.nan)
        surface[1, RIGHT_WRIST] = np.nan
        columns[f"error_{lifting}"] = surface
    return Sample(columns, np.array(["kinds", "kinds"]), "learned")


@pytest.fixture
def lifted() -> dict[tuple[str, str], LiftedJoints]:
    return {(one.group, one.sort): one for one in lifted_joints({"none": two_frames()})}


def test_errors_of_seen_joints_of_wrists_among_them_and_of_inferred_ones(lifted):
    seen, wrists, inferred = (lifted["all", sort] for sort in ("seen", "wrists", "inferred"))
    assert (seen.joints, wrists.joints, inferred.joints) == (4, 2, 17)
    assert seen.error.value == pytest.approx((0.02 + 0.20 + 0.04 + 0.10) / 4)
    assert wrists.error.value == pytest.approx((0.20 + 0.10) / 2)
    assert inferred.error.value == pytest.approx((0.30 + 0.50) / 17)
    assert lifted["all", "all"].joints == 21
    assert lifted["all", "all"].error.value == pytest.approx((0.36 + 0.80) / 21)


def test_shares_are_of_all_joints_of_all_frames_and_of_all_wrists(lifted):
    assert lifted["all", "seen"].share.value == pytest.approx(4 / 36)
    assert lifted["all", "wrists"].share.value == pytest.approx(2 / 4)
    assert lifted["all", "inferred"].share.value == pytest.approx(17 / 36)
    assert lifted["all", "all"].share.value == pytest.approx(21 / 36)


def test_the_radius_is_the_median_and_coverage_the_share_within(lifted):
    # Of 0.03, 0.05, 0.10 and 0.30, the smallest that half of them are not above.
    assert lifted["all", "seen"].radius.value == 0.05
    assert lifted["all", "inferred"].radius.value == 0.5
    assert lifted["all", "seen"].coverage.value == pytest.approx(2 / 4)
    assert lifted["all", "inferred"].coverage.value == pytest.approx(16 / 17)
    assert lifted["all", "all"].coverage.value == pytest.approx(18 / 21)


def test_surfaces_are_told_over_the_seen_joints_that_they_located(lifted):
    own = {one.lifting: one for one in lifted["all", "seen"].surface}
    assert {name: one.joints for name, one in own.items()} == {"mean": 3, "median": 3, "nearest": 3}
    assert [one.error.value for one in own.values()] == pytest.approx([0.3, 0.2, 0.1])
    assert [one.joints for one in lifted["all", "wrists"].surface] == [1, 1, 1]
    assert lifted["all", "inferred"].surface == lifted["all", "all"].surface == ()


def test_frames_are_grouped_by_distance_and_by_the_kinds_that_are_kept_for_tests(lifted):
    assert [group for group, sort in lifted if sort == "seen"] == ["all", "under 3 m", "5 to 9 m", "kind 6"]
    assert lifted["kind 6", "seen"].error.value == pytest.approx((0.02 + 0.20) / 2)
    assert lifted["5 to 9 m", "seen"].error.value == pytest.approx((0.04 + 0.10) / 2)


def test_families_are_groups_and_their_poses_of_no_kind(made_up_table):
    sample = samples_of(made_up_table(lifting="learned", families=FAMILIES))["none"]
    found = {(one.group, one.sort): one for one in lifted_joints({"none": sample})}
    assert [group for group, sort in found if sort == "all"] == ["all", "under 3 m", "3 to 5 m", "5 to 9 m", *FAMILIES]
    own = sample.of(sample.poses == "squat")
    assert len(own) == 12
    assert found["squat", "all"].error.value == pytest.approx(own["error"].mean())
    assert found["squat", "all"].error.low < found["squat", "all"].error.value < found["squat", "all"].error.high


def test_with_nobody_found_there_is_nothing_to_tell():
    sample = two_frames()
    sample["error"][:] = np.nan
    found = list(lifted_joints({"none": sample}))
    assert {one.joints for one in found} == {0}
    assert {one.share.value for one in found} == {0.0}
    assert all(math.isnan(one.error.value) and math.isnan(one.radius.value) for one in found)
    assert "nan" not in "".join(lifting_sections(found))


def test_other_liftings_have_no_such_figures(made_up_table):
    assert list(lifted_joints(samples_of(made_up_table(8)))) == []


def test_a_row_of_the_page_has_the_surfaces_share_of_the_seen_joints(lifted):
    text = "\n".join(lifting_sections(list(lifted.values())))
    (row,) = (line for line in text.splitlines() if line.startswith("| kind 6, wrists |"))
    assert row.count("(1.00)") == 3
    (row,) = (line for line in text.splitlines() if line.startswith("| all, seen |"))
    assert row.count("(0.75)") == 3
    assert "by mean | by median | by nearest" in text
