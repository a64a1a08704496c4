from pathlib import Path

import pytest

from protocol.config import PerceptionConfig, RunConfig, settled
from protocol.config_file import load_config
from protocol.errors import InvalidConfig

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.toml"))


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_every_configuration_that_we_ship_is_right(path):
    assert load_config(path).training.steps > 0


def test_an_empty_file_is_every_default(tmp_path):
    (tmp_path / "empty.toml").touch()
    assert load_config(tmp_path / "empty.toml") == RunConfig()


def test_one_line_changes_the_learner(tmp_path):
    (tmp_path / "ppo.toml").write_text('[learner]\nalgorithm = "ppo"\n')
    assert load_config(tmp_path / "ppo.toml").learner.algorithm == "ppo"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[environment.camera]\nwidht = 640\n", r"widht.*environment\.camera"),
        ('[training]\nsteps = "many"\n', r"training\.steps"),
        ("[perception]\nrows = 241\n", r"perception\.rows"),
        ("[environment]\nbeta = 1.0\n", r"environment\.beta"),
        ("seed = -1\n", r"seed"),
        ("seed = \n", r"broken\.toml"),
    ],
)
def test_a_wrong_field_is_named(tmp_path, text, named):
    (tmp_path / "broken.toml").write_text(text)
    with pytest.raises(InvalidConfig, match=named):
        load_config(tmp_path / "broken.toml")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidConfig, match=r"nowhere\.toml"):
        load_config(tmp_path / "nowhere.toml")


class TestSettled:
    def test_leaves_the_choice_to_the_profile(self):
        assert settled(PerceptionConfig(), "thesis").lifting == "mean"
        assert settled(PerceptionConfig(), "vantage").lifting == "learned"

    def test_keeps_what_was_chosen(self):
        assert settled(PerceptionConfig(lifting="median"), "thesis").lifting == "median"
