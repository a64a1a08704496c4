import math
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
import tomli_w
from msgspec import Struct
from msgspec.structs import asdict, replace

from protocol.config import PerceptionConfig, RunConfig, settled
from protocol.config_file import load_config, plain, recorded_config, resolved
from protocol.environment_config import EnvironmentConfig
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
        ("[perception]\ninput_height = 241\n", r"perception\.input_height"),
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


def numbers(section: Struct, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], float]]:
    """Every number of a configuration, and where it is."""
    for name, value in asdict(section).items():
        if isinstance(value, Struct):
            yield from numbers(value, (*path, name))
        elif isinstance(value, int | float):
            yield (*path, name), value


def changed(path: tuple[str, ...], value: object) -> str:
    """A configuration in which one field is another."""
    for name in reversed(path):
        value = {name: value}
    return tomli_w.dumps(value)


@pytest.mark.parametrize("path", [path for path, _ in numbers(RunConfig())], ids=".".join)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, -1e300])
def test_a_number_that_can_t_be_is_refused_by_name(tmp_path, path, value):
    (tmp_path / "odd.toml").write_text(changed(path, value))
    with pytest.raises(InvalidConfig, match=rf"odd\.toml: .*{path[-1]}"):
        load_config(tmp_path / "odd.toml")


@pytest.mark.parametrize("path", [path for path, value in numbers(RunConfig()) if isinstance(value, int)], ids=".".join)
@pytest.mark.parametrize("value", [2**63, 10**30, -(10**30)])
def test_a_number_beyond_all_machines_is_refused_by_name(tmp_path, path, value):
    (tmp_path / "odd.toml").write_text(changed(path, value))
    with pytest.raises(InvalidConfig, match=rf"odd\.toml: .*{path[-1]}"):
        load_config(tmp_path / "odd.toml")


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (
            "[environment.camera]\nwidth = 8192\nheight = 8192\n",
            r"environment\.camera\.width, height: a picture of 8192×",
        ),
        (
            "[environment]\nkeep_out_radius = 8.0\n",
            r"environment\.keep_out_radius, half_width: a keep-out of 8.0 m",
        ),
        (
            "[environment]\nmax_altitude = 1.4\n",
            r"environment\.min_altitude, max_altitude: a workspace from 0.5 to 1.4 m high has no room",
        ),
        ("[learner.sac]\nbuffer_size = 255\n", r"learner\.sac\.buffer_size: 255 transitions hold no batch of 256"),
        (
            "[learner.sac]\nbuffer_size = 5\nbatch_size = 3\n[environment]\nnum_envs = 6\n",
            r"learner\.sac\.buffer_size: 5 transitions",
        ),
        (
            '[learner]\nalgorithm = "ppo"\n[learner.ppo]\nn_steps = 1\nminibatches = 5\n',
            r"learner\.ppo\.n_steps: 1 steps of 4 drones make no 5 minibatches",
        ),
        ('[perception]\nbackend = "onnxruntime"\nprecision = "bf16"\n', r"perception\.precision: bf16 is OpenVINO's"),
        ("[evaluation]\nfirst_seed = -1\n", r"evaluation\.first_seed"),
    ],
)
def test_fields_that_don_t_go_together_are_named(tmp_path, text, named):
    (tmp_path / "odd.toml").write_text(text)
    with pytest.raises(InvalidConfig, match=named):
        load_config(tmp_path / "odd.toml")


def test_only_the_learner_that_is_chosen_has_to_fit(tmp_path):
    (tmp_path / "ppo.toml").write_text('[learner]\nalgorithm = "ppo"\n[learner.sac]\nbuffer_size = 1\n')
    assert load_config(tmp_path / "ppo.toml").learner.sac.buffer_size == 1


def test_the_largest_picture_that_travels_is_taken():
    camera = EnvironmentConfig().camera
    assert replace(camera, width=4096, height=4096).width == 4096
    with pytest.raises(InvalidConfig):
        replace(camera, width=4096, height=4097)


def test_a_memory_that_no_machine_has_is_refused():
    config = msgspec.convert({"learner": {"sac": {"buffer_size": 10**9}}}, RunConfig)
    config.require_memory(2**40)
    with pytest.raises(InvalidConfig, match=r"learner\.sac\.buffer_size: 1000000000 transitions take 745\.1 GiB"):
        config.require_memory(2**30)


class TestSettled:
    def test_leaves_the_choice_to_the_profile(self):
        assert settled(PerceptionConfig(), "thesis").lifting == "mean"
        assert settled(PerceptionConfig(), "vantage").lifting == "learned"

    def test_keeps_what_was_chosen(self):
        assert settled(PerceptionConfig(lifting="median"), "thesis").lifting == "median"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (b"[perception]\nnet = 1\n", "net"),
        (b"[perception\n", "table.parquet"),
        (b"\xff\xfe", "is not UTF-8"),
        (b"[resolved]\nformat = 99\nleft_out = []\n", "later version"),
    ],
)
def test_what_a_table_records_that_is_no_configuration_is_refused_with_the_tables_name(tmp_path, text, named):
    with pytest.raises(InvalidConfig, match=named):
        recorded_config(text, tmp_path / "table.parquet")


def test_a_table_may_record_a_configuration_with_a_mark_or_without(tmp_path):
    config = RunConfig(seed=3)
    for table in (resolved(config), plain(config)):
        assert recorded_config(tomli_w.dumps(table).encode(), tmp_path / "table.parquet") == config
