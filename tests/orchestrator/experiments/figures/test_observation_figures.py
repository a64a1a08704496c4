import numpy as np
import pytest

from orchestrator.experiments.figures.observation_figures import coverages, errors, scores
from orchestrator.experiments.figures.sample import BANDS, samples_of


@pytest.fixture
def samples(made_up_table):
    return samples_of(made_up_table())


@pytest.fixture
def learned(made_up_table):
    return samples_of(made_up_table(lifting="learned"))


def test_there_is_a_score_for_each_noise_band_and_uncertainty(samples):
    found = [(one.noise, one.band, one.uncertainty) for one in scores(samples)]
    assert len(set(found)) == len(found) == 2 * len(BANDS) * 8


def test_scores_are_those_of_the_located_joints_and_frames(samples):
    own = {one.uncertainty: one for one in scores({"none": samples["none"]}) if one.band == "all"}["quality, nearest"]
    sample = samples["none"]
    located = sample["located"] == 1
    uncertainty, error = 1 - sample["quality_nearest"][located], sample["error_nearest"][located]
    assert own.joints == located.sum()
    assert own.joint_raw.value == pytest.approx(np.corrcoef(uncertainty, error)[0, 1])
    assert own.joint_clipped.value == pytest.approx(np.corrcoef(uncertainty, np.minimum(error, 1))[0, 1])
    wrong = error > 0.15
    wins = np.mean(uncertainty[wrong][:, None] > uncertainty[~wrong])
    assert own.joint_auroc.value == pytest.approx(wins, abs=1e-3)
    frame_means = [
        (np.mean(1 - sample["quality_nearest"][n][located[n]]), np.mean(sample["error_nearest"][n][located[n]]))
        for n in range(len(sample))
    ]
    assert own.located_raw.value == pytest.approx(np.corrcoef(np.transpose(frame_means))[0, 1])
    assert own.located_raw.low < own.located_raw.value < own.located_raw.high


def test_bands_split_the_frames(samples):
    own = [one for one in scores(samples) if (one.noise, one.uncertainty) == ("none", "radius")]
    by_band = {one.band: one.joints for one in own}
    assert by_band.pop("all") == sum(by_band.values())


def test_coverage_is_the_share_of_errors_within_the_radius(samples):
    found = {(one.noise, one.band, one.joint): one for one in coverages(samples)}
    sample = samples["none"]
    located = sample["located"] == 1
    held = sample["error"][located] <= sample["radius"][located]
    assert found["none", "all", "all"].coverage.value == pytest.approx(held.mean())
    assert found["none", "all", "all"].radius.value == pytest.approx(sample["radius"][located].mean())
    nose = located[:, 0]
    own = found["none", "all", "nose"]
    assert own.coverage.value == pytest.approx(np.mean(sample["error"][nose, 0] <= sample["radius"][nose, 0]))
    assert (own.joints, len(found)) == (nose.sum(), 2 * (len(BANDS) + 18))


def test_a_worker_that_is_not_calibrated_has_no_coverage(made_up_table):
    assert list(coverages(samples_of(made_up_table(calibrated=False)))) == []


def test_errors_of_a_joint_under_each_lifting(samples):
    found = {(one.noise, one.lifting, one.joint): one for one in errors(samples)}
    own, sample = found["d435i", "mean", "right wrist"], samples["d435i"]
    error = sample["error_mean"][:, 4]
    assert own.located.value == pytest.approx(np.isfinite(error).mean())
    error = error[np.isfinite(error)]
    assert own.mean.value == pytest.approx(error.mean())
    assert own.far_off.value == pytest.approx(np.mean(error > 0.3))
    assert own.p90.value == np.quantile(error, 0.9, method="inverted_cdf")
    assert len(found) == 2 * 3 * 19


def test_scores_of_a_learned_lifter_are_of_seen_joints_with_errors_above_a_tenth_of_a_metre_wrong(learned):
    own = {one.uncertainty: one for one in scores({"none": learned["none"]}) if one.band == "all"}
    found, sample = own["expected error"], learned["none"]
    seen = sample["detected"] == 1
    assert found.joints == seen.sum() < seen.size
    expected, error = sample["expected_error"], sample["error"]
    wrong = error[seen] > 0.10
    wins = np.mean(expected[seen][wrong][:, None] > expected[seen][~wrong])
    assert found.joint_auroc.value == pytest.approx(wins, abs=1e-3)
    assert found.all_raw.value == pytest.approx(np.corrcoef(expected.mean(axis=1), error.mean(axis=1))[0, 1])
    assert (found.wrong, own["radius"].wrong, own["quality, mean"].wrong) == (0.10, 0.10, 0.15)


def test_errors_of_a_learned_lifter_are_told_over_seen_joints_beside_the_others(learned):
    found = {(one.noise, one.lifting, one.joint): one for one in errors(learned)}
    own, sample = found["none", "learned", "left wrist"], learned["none"]
    seen = sample["detected"][:, 7] == 1
    assert own.located.value == pytest.approx(seen.mean())
    assert own.mean.value == pytest.approx(sample["error"][seen, 7].mean())
    assert len(found) == 2 * 4 * 19


def test_coverage_of_a_learned_lifter_is_of_all_joints(learned):
    found = {(one.noise, one.band, one.joint): one for one in coverages(learned)}
    assert found["none", "all", "all"].joints == 60 * 18
    assert found["none", "all", "nose"].joints == 60
