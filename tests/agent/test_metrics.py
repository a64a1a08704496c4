import os
from pathlib import Path

import pytest
from prometheus_client import CollectorRegistry

from agent.metrics import TrainingMetrics, checkpoint_age
from protocol.records import Progress


def progress(phase, step, **more) -> Progress:
    return Progress(time=1e9, phase=phase, step=step, steps=100, steps_per_second=4.5, **{"episodes": 0, **more})


@pytest.fixture
def metrics(tmp_path: Path) -> TrainingMetrics:
    return TrainingMetrics(tmp_path / "checkpoints", lambda: 12, clock=lambda: 1000.0)


@pytest.fixture
def value(metrics: TrainingMetrics):
    registry = CollectorRegistry()
    registry.register(metrics)
    return registry.get_sample_value


def test_before_the_first_word_nothing_is_made_up(metrics, value) -> None:
    assert not metrics.has_begun
    for name in ("episodes_total", "episode_return", "uncertainty", "steps_per_second", "checkpoint_age_seconds"):
        assert value(f"vantage_{name}") is None
    assert value("vantage_updates_total") == 12


def test_steps_are_counted_by_phase_and_the_end_is_none(metrics, value) -> None:
    for record in (progress("prefill", 10), progress("training", 2), progress("training", 8), progress("done", 8)):
        metrics.progress(record)
    steps = {phase: value("vantage_environment_steps_total", {"phase": phase}) for phase in ("prefill", "training")}
    assert steps == {"prefill": 10, "training": 8}
    assert value("vantage_environment_steps_total", {"phase": "done"}) is None


def test_the_last_word_counts(metrics, value) -> None:
    metrics.progress(progress("training", 1))
    assert value("vantage_episode_return") is None
    metrics.progress(progress("training", 2, episodes=3, episode_return=-1.5, uncertainty=7.25))
    assert metrics.has_begun
    assert value("vantage_episodes_total") == 3
    assert value("vantage_episode_return") == -1.5
    assert value("vantage_uncertainty") == 7.25
    assert value("vantage_steps_per_second") == 4.5


def test_who_learns_nothing_has_no_updates(tmp_path: Path) -> None:
    registry = CollectorRegistry()
    registry.register(TrainingMetrics(tmp_path, None))
    assert registry.get_sample_value("vantage_updates_total") is None


def test_only_checkpoints_that_were_written_are_timed(metrics, value) -> None:
    with metrics.checkpoint():
        pass
    with pytest.raises(OSError, match="full"), metrics.checkpoint():
        raise OSError("the disk is full")
    assert value("vantage_checkpoint_duration_seconds_count") == 1


def test_a_checkpoints_age_grows_with_the_clock_that_nobody_sets(tmp_path: Path) -> None:
    checkpoints, steady = tmp_path / "checkpoints", [50.0]
    (checkpoints / "step-000000010").mkdir(parents=True)
    os.utime(checkpoints / "step-000000010", (700, 700))
    metrics = TrainingMetrics(checkpoints, None, clock=lambda: steady[0], wall_clock=lambda: 1000.0)
    registry = CollectorRegistry()
    registry.register(metrics)
    assert registry.get_sample_value("vantage_checkpoint_age_seconds") == 300.0
    steady[0] += 60.0
    assert registry.get_sample_value("vantage_checkpoint_age_seconds") == 360.0
    with metrics.checkpoint():
        pass
    steady[0] += 5.0
    assert registry.get_sample_value("vantage_checkpoint_age_seconds") == 5.0


def test_the_newest_checkpoint_gives_the_age_and_what_is_aside_none(tmp_path: Path) -> None:
    assert checkpoint_age(tmp_path / "none", 1000.0) is None
    for name, written in (("step-000000010", 400), ("step-000000020", 700), (".step-000000030.x", 900)):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (written, written))
    assert checkpoint_age(tmp_path, 1000.0) == 300.0
    assert checkpoint_age(tmp_path, 600.0) == 0.0
