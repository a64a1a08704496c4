from pathlib import Path

import pytest
from msgspec.structs import replace

from orchestrator.errors import NoSuchRun, RunBusy
from orchestrator.experiments.directory import ExperimentDirectory, default_path
from orchestrator.experiments.views import ViewSet
from protocol.config import PerceptionConfig, RenderConfig, RunConfig, TimeoutsConfig
from protocol.errors import InvalidInput

VIEWS = ViewSet(frames=10, split="train", seed=1)


def test_an_experiment_is_taken_up_with_what_it_was_begun_with(tmp_path):
    begun = ExperimentDirectory.open_for(tmp_path / "a" / "b", RunConfig(), VIEWS)
    assert ExperimentDirectory.open_for(begun.path, RunConfig(), VIEWS) == begun
    assert ExperimentDirectory.open(begun.path).views() == VIEWS
    assert begun.config() == RunConfig()


@pytest.mark.parametrize(
    "other",
    [
        {"frames": 11},
        {"split": "test"},
        {"seed": 2},
        {"depth_noises": ("none",)},
        {"views_a_scene": 2},
        {"frames_a_part": 9},
        {"poses": "families"},
    ],
)
def test_other_views_are_refused_with_both_named(tmp_path, other):
    ExperimentDirectory.open_for(tmp_path, RunConfig(), VIEWS)
    with pytest.raises(InvalidInput, match=r"10 frames of train, seed 1.*not .*--out"):
        ExperimentDirectory.open_for(tmp_path, RunConfig(), replace(VIEWS, **other))


def test_families_have_a_directory_of_their_own():
    assert default_path(VIEWS) == Path("runs/experiments/qoe-train-1")
    assert default_path(replace(VIEWS, poses="families")) == Path("runs/experiments/qoe-train-1-families")


def test_another_configuration_is_refused(tmp_path):
    ExperimentDirectory.open_for(tmp_path, RunConfig(), VIEWS)
    with pytest.raises(InvalidInput, match="another configuration"):
        ExperimentDirectory.open_for(tmp_path, RunConfig(profile="thesis"), VIEWS)


def test_more_workers_and_more_patience_are_no_other_experiment(tmp_path):
    ExperimentDirectory.open_for(tmp_path, RunConfig(), VIEWS)
    config = RunConfig(
        render=RenderConfig(workers=3), perception=PerceptionConfig(workers=4), timeouts=TimeoutsConfig(call=99.0)
    )
    ExperimentDirectory.open_for(tmp_path, config, VIEWS)


def test_a_directory_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InvalidInput, match="no experiment"):
        ExperimentDirectory.open_for(tmp_path, RunConfig(), VIEWS)
    with pytest.raises(NoSuchRun):
        ExperimentDirectory.open(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_beginning_that_was_cut_off_begins_again(tmp_path):
    (tmp_path / "config.toml").write_text("seed = 4\n")
    assert ExperimentDirectory.open_for(tmp_path, RunConfig(), VIEWS).config() == RunConfig()


def test_two_commands_do_not_work_on_one_experiment(tmp_path):
    first = ExperimentDirectory.open_for(tmp_path, RunConfig(), VIEWS)
    with first.lock(), pytest.raises(RunBusy), ExperimentDirectory(tmp_path).lock():
        pytest.fail("there is one at work")
