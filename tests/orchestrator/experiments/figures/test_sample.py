import numpy as np
import pytest

from orchestrator.experiments.figures.sample import (
    LARGEST_ERROR,
    inferred_joints,
    samples_of,
    seen_joints,
    truth_of,
    uncertainties,
)


def test_frames_are_told_apart_by_their_noise_and_keep_their_order(made_up_table):
    samples = samples_of(made_up_table(12))
    assert list(samples) == ["none", "d435i"]
    for sample in samples.values():
        assert list(sample["frame"]) == list(range(12))
        assert sample["error"].shape == (12, 18)
        assert sample["distance"].shape == (12,)


def test_a_band_has_the_frames_from_its_lower_end_to_before_its_upper_one(made_up_table):
    sample = samples_of(made_up_table(40))["none"]
    near, far = sample.within((0.0, 4.0)), sample.within((4.0, np.inf))
    assert len(near) + len(far) == 40
    assert near["distance"].max() < 4.0 <= far["distance"].min()
    edge = float(sample["distance"][3])
    assert 3 in sample.within((edge, edge + 1e-6))["frame"]
    assert 3 not in sample.within((0.0, edge))["frame"]


def test_uncertainty_is_one_less_quality_and_error_the_distance_to_the_truth(made_up_table):
    sample = samples_of(made_up_table(5))["none"]
    estimates = uncertainties(sample)["quality, median"]
    located = estimates.located
    assert (located == (sample["located"] == 1)).all()
    assert estimates.uncertainty[located] == pytest.approx(1 - sample["quality_median"][located])
    assert estimates.error[located] == pytest.approx(sample["error_median"][located], abs=1e-6)
    assert truth_of(sample)[0, 0] == pytest.approx([sample[f"true_{axis}"][0, 0] for axis in "xyz"])


def test_a_calibrated_worker_adds_two_uncertainties_in_metres(made_up_table):
    plain = uncertainties(samples_of(made_up_table(3, calibrated=False))["none"])
    calibrated = uncertainties(samples_of(made_up_table(3))["none"])
    assert set(calibrated) - set(plain) == {"expected error", "radius"}
    assert {one.missing for one in plain.values()} == {1.0}
    assert calibrated["radius"].missing == LARGEST_ERROR


def test_a_learned_lifter_has_inferred_what_was_not_detected(made_up_table):
    sample = samples_of(made_up_table(5, lifting="learned"))["none"]
    detected = sample["detected"] == 1
    assert (seen_joints(sample) == detected).all()
    assert (inferred_joints(sample) == ~detected).all()
    for name in ("expected error", "radius"):
        estimates = uncertainties(sample)[name]
        assert (estimates.located == detected).all()
        assert estimates.placed.all()
        assert estimates.wrong == 0.10


def test_of_nobody_found_no_joint_is_seen_or_inferred(made_up_table):
    sample = samples_of(made_up_table(5, lifting="learned"))["none"]
    sample["error"][2] = np.nan
    assert not seen_joints(sample)[2].any()
    assert not inferred_joints(sample)[2].any()


def test_other_liftings_infer_nothing(made_up_table):
    sample = samples_of(made_up_table(5))["none"]
    assert (seen_joints(sample) == (sample["located"] == 1)).all()
    assert not inferred_joints(sample).any()
    assert {one.wrong for one in uncertainties(sample).values()} == {0.15}


def test_a_table_that_was_made_before_there_were_families_is_of_the_kinds(made_up_table):
    table = made_up_table(4)
    before, now = samples_of(table.drop_columns("poses"))["none"], samples_of(table)["none"]
    assert list(before.poses) == list(now.poses) == ["kinds"] * 4
