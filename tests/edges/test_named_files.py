"""A configuration's files are its own: relative to it, recorded, and with another one nothing is gone on with.

Whatever takes a path gets its rows here by being marked as a `NamedFile`, and by nothing else.
"""

import os
from pathlib import Path

import msgspec
import pytest
import tomli_w
from msgspec.structs import replace

from agent.__main__ import main as run_agent
from agent.checkpointing.resume_fingerprint import fingerprint, require_same
from agent.errors import OtherConfig
from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.views import ViewSet
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.versions import collect_versions
from perception_worker.worker import main as serve_perception
from protocol.config import RunConfig
from protocol.config_file import for_a_run, load_config, load_resolved_config, with_checksums
from protocol.errors import InvalidConfig, OtherArtifact
from protocol.named_files import path_settings
from protocol.system.exit_code import ExitCode
from render_worker.worker import main as serve_rendering

SETTINGS = [setting.name for setting in path_settings(RunConfig())]
FILE = "mine.file"


def setting_table(name: str, value: str) -> dict[str, dict[str, str]]:
    section, _, setting = name.partition(".")
    return {section: {setting: value}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A configuration's own folder, which is not where commands are called."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "mine" / FILE).write_bytes(b"ours")
    (tmp_path / "elsewhere" / FILE).write_bytes(b"another one of the same name")
    return tmp_path / "mine"


@pytest.fixture(autouse=True)
def elsewhere(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VANTAGE_CACHE", str(folder / "cache"))
    monkeypatch.chdir(folder.parent / "elsewhere")
    return Path.cwd()


def write_config(folder: Path, name: str, value: str = FILE) -> Path:
    path = folder / "mine.toml"
    path.write_text(tomli_w.dumps(setting_table(name, value)))
    return path


def value_of(config: RunConfig, name: str) -> str | None:
    return {setting.name: setting.value for setting in path_settings(config)}[name]


def make_run(config: RunConfig, path: Path) -> RunDirectory:
    return RunDirectory.create(path, config, collect_versions({}))


@pytest.mark.parametrize("name", SETTINGS)
class TestEveryFile:
    def test_is_beside_the_configuration_that_names_it(self, folder, name):
        assert value_of(load_config(write_config(folder, name)), name) == str(folder / FILE)

    def test_is_refused_where_it_is_not_there(self, folder, name):
        with pytest.raises(InvalidConfig, match=f"{name}: there is no file {folder / 'none.file'}"):
            for_a_run(load_config(write_config(folder, name, "none.file")))

    def test_is_refused_by_name_in_a_folder_whose_own_name_no_configuration_can_hold(self, folder, name):
        latin_1 = folder / os.fsdecode(b"caf\xe9")
        latin_1.mkdir()
        with pytest.raises(InvalidConfig, match=rf"{name}: .*caf\?/{FILE} is not UTF-8"):
            load_config(write_config(latin_1, name))

    def test_is_needed_only_on_the_machine_that_reads_it(self, folder, name):
        config = for_a_run(load_config(write_config(folder, name, "none.file")), joined=True)
        assert config.artifacts == {}

    def test_is_the_one_that_the_run_was_made_with(self, folder, tmp_path, name):
        run = make_run(for_a_run(load_config(write_config(folder, name))), tmp_path / "run")
        run.verified_config()
        (folder / FILE).write_bytes(b"ours, trained for longer")
        with pytest.raises(OtherArtifact, match=f"{name}: .* is another one: {folder / FILE}"):
            run.verified_config()
        (folder / FILE).unlink()
        with pytest.raises(OtherArtifact, match=f"{name}: .* is missing"):
            run.verified_config()

    def test_may_be_moved(self, folder, tmp_path, name):
        path = write_config(folder, name)
        before = for_a_run(load_config(path))
        run = make_run(before, tmp_path / "run")
        (folder / FILE).rename(folder / "moved.file")
        text = run.config_path.read_text().replace(str(folder / FILE), str(folder / "moved.file"))
        run.config_path.write_text(text)
        run.verified_config()
        require_same(fingerprint(before), run.config(), "a checkpoint")
        RunDirectory.open(run.path).config_matching(for_a_run(load_config(write_config(folder, name, "moved.file"))))

    def test_is_what_a_checkpoint_says(self, folder, name):
        path = write_config(folder, name)
        before = fingerprint(for_a_run(load_config(path)))
        (folder / FILE).write_bytes(b"another one")
        with pytest.raises(OtherConfig, match=name):
            require_same(before, for_a_run(load_config(path)), "a checkpoint")

    def test_is_the_one_that_an_experiment_was_begun_with(self, folder, tmp_path, name):
        path, views = write_config(folder, name), ViewSet(frames=1)
        ExperimentDirectory.open_for(tmp_path / "experiment", with_checksums(load_config(path)), views)
        ExperimentDirectory.open_for(tmp_path / "experiment", with_checksums(load_config(path)), views)
        (folder / FILE).write_bytes(b"another one")
        with pytest.raises(OtherArtifact, match=name):
            ExperimentDirectory.open_for(tmp_path / "experiment", with_checksums(load_config(path)), views)

    def test_is_held_against_its_record_by_the_process_that_reads_it(self, folder, tmp_path, name, capfd):
        run = make_run(for_a_run(load_config(write_config(folder, name))), tmp_path / "run")
        (folder / FILE).write_bytes(b"another one")
        section = name.partition(".")[0]
        options = ["--bind", f"ipc://{tmp_path}/s", "--config", str(run.config_path), "--orchestrator", "ipc:///none"]
        if section == "grid":
            ended = run_agent(["train", "--run", str(run.path), "--orchestrator", "ipc:///none"])
        else:
            ended = {"render": serve_rendering, "perception": serve_perception}[section](options)
        assert ended == ExitCode.HOPELESS
        assert "is another one" in capfd.readouterr().err


def test_a_word_is_a_name_and_no_file_even_where_there_is_one(folder):
    (folder / "movenet_thunder").touch()
    assert value_of(load_config(write_config(folder, "perception.network", "movenet_thunder")), SETTINGS[1]) == (
        "movenet_thunder"
    )
    for word in ("auto", "none"):
        config = load_config(write_config(folder, "perception.calibration", word))
        assert config.perception.calibration == word
        assert "perception.calibration" not in for_a_run(config).artifacts


def test_the_bodies_of_the_cache_are_recorded_as_well_and_may_be_in_another_cache(folder, tmp_path, monkeypatch):
    cache = folder / "cache"
    cache.mkdir()
    (cache / "bodies-v1.npz").write_bytes(b"bodies")
    run = make_run(for_a_run(RunConfig()), tmp_path / "run")
    cache.rename(folder / "moved")
    monkeypatch.setenv("VANTAGE_CACHE", str(folder / "moved"))
    run.verified_config()
    (folder / "moved" / "bodies-v1.npz").write_bytes(b"bodies that were baked anew")
    with pytest.raises(OtherArtifact, match=r"render\.bodies: the file of bodies is another one"):
        run.verified_config()


def test_a_checksum_that_is_written_into_a_configuration_is_held_to(folder):
    path = folder / "mine.toml"
    table = setting_table("perception.network", FILE) | {"artifacts": {"perception.network": "0" * 64}}
    path.write_text(tomli_w.dumps(table))
    with pytest.raises(OtherArtifact, match="the network is another one"):
        for_a_run(load_config(path))


def test_an_older_runs_relative_path_is_of_no_known_folder_and_is_refused(folder):
    config = load_config(write_config(folder, "perception.network"))
    old = replace(config, perception=replace(config.perception, network=FILE))
    (folder / "config.toml").write_bytes(without_mark(resolved_toml(old)))
    with pytest.raises(InvalidConfig, match=r"perception\.network = 'mine\.file', and an older version"):
        load_resolved_config(folder / "config.toml")


def test_an_older_checkpoints_relative_path_is_taken_for_the_absolute_one_of_its_name(folder):
    config = load_config(write_config(folder, "perception.network"))
    old = fingerprint(replace(config, perception=replace(config.perception, network=FILE)))
    require_same(old, config, "a checkpoint")
    other = replace(config, perception=replace(config.perception, network=str(folder / "other.file")))
    with pytest.raises(OtherConfig, match="network"):
        require_same(old, other, "a checkpoint")


def without_mark(text: bytes) -> bytes:
    table = msgspec.toml.decode(text)
    del table["resolved"], table["artifacts"]
    return tomli_w.dumps(table).encode()


def test_no_command_depends_on_where_it_is_called(folder, tmp_path):
    path = write_config(folder, "perception.network")
    relative = Path(os.path.relpath(path))
    assert load_config(relative) == load_config(path)
