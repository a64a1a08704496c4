import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.experiments.figures.frames import all_joints, located_only
from orchestrator.experiments.figures.sample import Estimates


def estimates(missing: float = 1.0) -> Estimates:
    """Frame 0: two joints located, 0.5 and 3 m off; frame 1: none; frame 2: all of them exact."""
    truth = np.zeros((3, 18, 3))
    points, uncertainty = np.full((3, 18, 3), np.nan), np.full((3, 18), np.nan)
    points[0, 0], uncertainty[0, 0] = (0.5, 0, 0), 0.2
    points[0, 1], uncertainty[0, 1] = (0, 3.0, 0), 0.6
    points[2], uncertainty[2] = truth[2], 0.25
    return Estimates(uncertainty, points, truth, missing)


def test_located_joints_alone_by_hand():
    found = located_only(estimates())
    assert list(found.kept) == [True, False, True]
    assert found.uncertainty == pytest.approx([0.4, 0.25])
    assert found.error == pytest.approx([1.75, 0.0])
    assert found.clipped == pytest.approx([0.75, 0.0])


def test_a_missing_joint_has_the_error_of_the_centroid():
    found = all_joints(estimates())
    # The centroid of frame 0 is (0.25, 1.5, 0), for each of the 16 missing joints that far from the truth.
    centroid = np.hypot(0.25, 1.5)
    assert list(found.kept) == [True, False, True]
    assert found.error == pytest.approx([(0.5 + 3.0 + 16 * centroid) / 18, 0.0])
    assert found.clipped == pytest.approx([(0.5 + 1.0 + 16) / 18, 0.0])
    assert found.uncertainty == pytest.approx([(0.2 + 0.6 + 16) / 18, 0.25])


def test_a_missing_joint_counts_as_uncertain_as_it_is_said_to():
    assert all_joints(estimates(missing=2.0)).uncertainty[0] == pytest.approx((0.2 + 0.6 + 32) / 18)


def test_joints_that_were_inferred_count_among_all_with_their_own_estimate_and_among_the_located_not_at_all():
    lifted = estimates()
    seen = np.isfinite(lifted.uncertainty)
    # The lifter puts the other 16 joints of frame 0 2 m away from the truth.
    lifted.points[0, 2:], lifted.uncertainty[0, 2:] = (0, 0, 2.0), 0.9
    lifted = replace(lifted, seen=seen)
    assert located_only(lifted).error == pytest.approx([1.75, 0.0])
    assert located_only(lifted).uncertainty == pytest.approx([0.4, 0.25])
    found = all_joints(lifted)
    # Nobody was found in frame 1: there is nothing to measure from.
    assert list(found.kept) == [True, False, True]
    assert found.error == pytest.approx([(0.5 + 3.0 + 16 * 2.0) / 18, 0.0])
    assert found.clipped == pytest.approx([(0.5 + 1.0 + 16) / 18, 0.0])
    assert found.uncertainty == pytest.approx([(0.2 + 0.6 + 16 * 0.9) / 18, 0.25])


def test_a_joint_without_an_uncertainty_does_not_count_as_located():
    lacking = estimates()
    lacking.uncertainty[0, 1] = np.nan
    assert located_only(lacking).error[0] == pytest.approx(0.5)
    # The other 17 are measured from the only one that is left.
    assert all_joints(lacking).error[0] == pytest.approx(0.5)
