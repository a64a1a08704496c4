"""Figures over seeds, by hand, and the page of them."""

from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from orchestrator.experiments.grid.page import page
from orchestrator.experiments.grid.results import grid_figures, seed_figure, seed_share, trained_runs
from orchestrator.experiments.grid.variants import VARIANTS, trainings
from protocol.config import RunConfig
from protocol.errors import InvalidInput
from protocol.grid.records import GridEvaluation, GridScore, GridThreshold
from protocol.learner_config import LearnerConfig
from protocol.records import Interval, Summary

GRID = RunConfig(env_id="vantage/Grid-v0", learner=LearnerConfig(algorithm="recurrent_ppo"))


def score(policy: str, success: float) -> GridScore:
    def rate(mean: float) -> Interval:
        return Interval(mean=mean, low=mean, high=mean)

    return GridScore(
        policy=policy,
        threshold=1.1,
        episodes=100,
        success=rate(success),
        success_of_solvable=rate(success),
        crash=rate(0.0),
        length=rate(7.0),
        length_deviation=2.0,
        success_length=rate(6.0) if success else None,
        ratio=1.2 if success else None,
        total_reward=rate(5.0),
        uncertainty=rate(1.0),
        failures={"crash": 0, "righteous": 1, "oscillating": 2, "circling": 0, "wandering": 0},
    )


def write_run(path: Path, success: float) -> None:
    threshold = GridThreshold(
        threshold=1.1, ceiling=0.95, optimum=4.5, scores=(score("recurrent_ppo", success), score("random", 0.25))
    )
    evaluation = GridEvaluation(
        split="test",
        table="thesis",
        table_checksum="0" * 64,
        environments=40,
        thresholds=(threshold,),
        weights=None,
        by="x",
    )
    summary = Summary(
        steps=1_000_000,
        episodes=3,
        updates=5,
        seconds=1800.0,
        steps_per_second=1.0,
        stages={},
        late_replies=0,
        retries=0,
    )
    path.mkdir(parents=True)
    (path / "grid.json").write_bytes(msgspec.json.encode(evaluation))
    (path / "summary.json").write_bytes(msgspec.json.encode(summary))


def test_a_figure_over_seeds_has_students_interval() -> None:
    """Of 0.8, 0.9 and 1.0: deviation 0.1, and t(0.975, 2) is 4.3027."""
    found = seed_figure([0.8, 0.9, 1.0])
    assert found.value == pytest.approx(0.9)
    assert found.high - 0.9 == pytest.approx(4.30265 * 0.1 / 3**0.5, rel=1e-4)
    assert found.low == pytest.approx(1.8 - found.high)


def test_the_interval_of_shares_ends_at_none_and_all() -> None:
    high, low, one = seed_share([0.8, 0.9, 1.0]), seed_share([0.0, 0.0, 0.3]), seed_share([0.5])
    assert (high.value, high.high) == (pytest.approx(0.9), 1.0)
    assert high.low == seed_figure([0.8, 0.9, 1.0]).low
    assert (low.value, low.low) == (pytest.approx(0.1), 0.0)
    assert one.low != one.low


def test_one_seed_has_no_interval_and_none_no_figure() -> None:
    one, none = seed_figure([0.5]), seed_figure([None])
    assert one.value == 0.5
    assert one.low != one.low
    assert none.value != none.value


def test_the_trainings_of_a_directory_are_compared_by_variant(tmp_path: Path) -> None:
    for name, success in (("quality-seed-0", 0.9), ("quality-seed-1", 1.0), ("binary-seed-0", 0.0)):
        write_run(tmp_path / name, success)
    (tmp_path / "quality-seed-2").mkdir()
    figures = grid_figures(trained_runs(tmp_path))
    assert (figures.trainings, figures.steps, figures.hours) == (3, 3_000_000, 1.5)
    (threshold,) = figures.thresholds
    assert [(one.policy, one.seeds) for one in threshold.policies] == [("quality", 2), ("binary", 1), ("random", 1)]
    quality, binary, _ = threshold.policies
    assert quality.success.value == pytest.approx(0.95)
    assert quality.failures["oscillating"] == 4
    assert binary.ratio.value != binary.ratio.value
    text = page(figures)
    assert "| **reward by quality** | 2 | 0.950 [" in text
    assert "| thesis: reward by quality | 1 | 0.925 |" in text
    assert "ceiling (share with a cell that succeeds) 0.950" in text


def test_a_directory_without_trainings_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="no evaluated training"):
        trained_runs(tmp_path)


def test_each_training_changes_one_thing(tmp_path: Path) -> None:
    planned = trainings(tmp_path, replace(GRID, seed=4), list(VARIANTS), 2)
    assert len({one.path for one in planned}) == 2 * len(VARIANTS)
    assert {one.seed for one in planned} == {4, 5}
    assert all(one.config.seed == one.seed for one in planned)
    of_seed = {one.variant: one.config for one in planned if one.seed == 4}
    base = of_seed["quality"]
    assert replace(of_seed["binary"], grid=base.grid) == base
    assert of_seed["binary"].grid == replace(base.grid, reward="binary")
    assert of_seed["vantage"].grid == replace(base.grid, table="vantage")
    assert of_seed["at-1.1"].grid == replace(base.grid, success_threshold=1.1)
    assert not of_seed["no-memory"].learner.recurrent_ppo.memory


def test_unknown_variants_and_other_environments_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="no variant fast"):
        trainings(tmp_path, GRID, ["quality", "fast"], 1)
    with pytest.raises(InvalidInput, match="Hover-v0"):
        trainings(tmp_path, RunConfig(), ["quality"], 1)
