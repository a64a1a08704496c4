"""What was written down to go on by is whole, or refused by name: nothing that is missing is read as a default."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import pytest
import tomli_w

from orchestrator.errors import NoSuchRun
from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.views import ViewSet
from orchestrator.lifter.directory import FitDirectory
from orchestrator.lifter.views import FitViews
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.versions import collect_versions
from protocol.config import PerceptionConfig, RunConfig
from protocol.config_file import load_config, load_resolved_config, load_run_config
from protocol.errors import DamagedRecord, InvalidConfig, InvalidInput

RESOLVED = Path(__file__).parent / "resolved-1.toml"
"""As the first version that marked its resolved configurations wrote them. Don't write it anew.

A setting that came later makes the test below fail: say in `config_file._CAME_AFTER` that without it nothing was
otherwise, or else raise the format and keep on reading this one.
"""

REFUSED = (InvalidConfig, InvalidInput, NoSuchRun)


def make_run(folder: Path) -> RunDirectory:
    config = RunConfig(perception=PerceptionConfig(network="/models/mine.onnx"))
    return RunDirectory.create(folder / "run", config, collect_versions({}))


def open_run(path: Path) -> None:
    RunDirectory.open(path).verified_config()


def make_experiment(folder: Path) -> ExperimentDirectory:
    return ExperimentDirectory.open_for(folder / "experiment", RunConfig(), ViewSet())


def open_experiment(path: Path) -> None:
    found = ExperimentDirectory.open(path)
    found.views(), found.config()


def make_fit(folder: Path) -> FitDirectory:
    return FitDirectory.open_for(folder / "fit", RunConfig(), FitViews())


def open_fit(path: Path) -> None:
    found = FitDirectory.open(path)
    found.views(), found.config()


# A new kind of directory, or of file in one, gets its tests by its row.
FILES: tuple[tuple[Callable[[Path], Any], Callable[[Path], None], str], ...] = (
    (make_run, open_run, "config.toml"),
    (make_run, open_run, "plan.json"),
    (make_run, open_run, "versions.json"),
    (make_experiment, open_experiment, "config.toml"),
    (make_experiment, open_experiment, "views.json"),
    (make_fit, open_fit, "config.toml"),
    (make_fit, open_fit, "views.json"),
)
MAY_LACK = {"versions.json": {"made"}, "views.json": {"poses"}, "config.toml": {"format", "left_out"}}
"""Came later; and the mark of a resolved configuration, which has tests of its own."""


@pytest.mark.parametrize(("make", "look", "name"), FILES, ids=lambda row: getattr(row, "__name__", row))
class TestEveryResolvedFile:
    def test_is_refused_wherever_it_was_cut_off(self, tmp_path, make, look, name):
        path = make(tmp_path).path
        whole = (path / name).read_bytes()
        look(path)
        for length in {0, *range(0, len(whole) - 1, max(1, len(whole) // 40))}:
            (path / name).write_bytes(whole[:length])
            with pytest.raises(REFUSED, match=name):
                look(path)

    def test_is_refused_by_the_name_of_whatever_it_lacks(self, tmp_path, make, look, name):
        path = make(tmp_path).path
        for lacked, text in without_each(path / name):
            (path / name).write_bytes(text)
            with pytest.raises(REFUSED, match=rf"{name} is damaged.*it lacks (\w+\.)*{lacked}\b"):
                look(path)

    def test_is_refused_where_it_is_gone(self, tmp_path, make, look, name):
        path = make(tmp_path).path
        (path / name).unlink()
        with pytest.raises(REFUSED, match=name):
            look(path)


def without_each(path: Path) -> Iterator[tuple[str, bytes]]:
    """The file without each of its fields in turn."""
    decode = msgspec.toml.decode if path.suffix == ".toml" else msgspec.json.decode
    encode = (lambda table: tomli_w.dumps(table).encode()) if path.suffix == ".toml" else msgspec.json.encode
    for name, table in list(tables_without_each(decode(path.read_bytes()))):
        if name not in MAY_LACK.get(path.name, ()):
            yield name, encode(table)


def tables_without_each(table: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, value in table.items():
        rest = {other: kept for other, kept in table.items() if other != name}
        if isinstance(value, dict) and name not in ("packages", "environment", "artifacts", "resolved"):
            yield from ((inner, rest | {name: less}) for inner, less in tables_without_each(value))
        elif name != "resolved":
            yield name, rest


def test_a_setting_that_is_none_is_told_from_one_that_was_lost(tmp_path):
    run = make_run(tmp_path)
    text = run.config_path.read_text()
    run.config_path.write_text("\n".join(line for line in text.splitlines() if not line.startswith("network")))
    with pytest.raises(InvalidConfig, match=r"it lacks perception\.network"):
        run.config()


def test_a_worker_refuses_a_damaged_one_as_well(tmp_path):
    run = make_run(tmp_path)
    text = run.config_path.read_text()
    run.config_path.write_text("\n".join(line for line in text.splitlines() if not line.startswith("lifting")))
    with pytest.raises(InvalidConfig, match=r"it lacks perception\.lifting"):
        load_config(run.config_path)


def test_the_agent_refuses_a_damaged_one_of_the_orchestrators_and_takes_one_that_a_person_wrote(tmp_path):
    run = make_run(tmp_path)
    run.config_path.write_bytes(b"")
    with pytest.raises(InvalidConfig, match="it lacks seed"):
        load_run_config(run.path)
    (tmp_path / "config.toml").write_text("seed = 3\n")
    assert load_run_config(tmp_path).seed == 3


def test_a_resolved_configuration_of_the_first_format_is_read_as_it_was():
    assert load_resolved_config(RESOLVED).training.steps == 40


def test_one_of_a_later_format_is_refused(tmp_path):
    (tmp_path / "config.toml").write_text(RESOLVED.read_text().replace("format = 1", "format = 99"))
    with pytest.raises(InvalidConfig, match="a later version"):
        load_resolved_config(tmp_path / "config.toml")


def older(**removed: tuple[str, ...]) -> bytes:
    """One of before resolved configurations were marked, without some settings."""
    table = msgspec.toml.decode(RESOLVED.read_bytes())
    del table["resolved"], table["artifacts"]
    for section, names in removed.items():
        for name in names:
            del table[section][name]
    return tomli_w.dumps(table).encode()


def test_an_older_one_may_lack_what_came_later_and_changes_nothing(tmp_path):
    (tmp_path / "config.toml").write_bytes(older(render=("prefetch",)))
    assert load_resolved_config(tmp_path / "config.toml").training.steps == 40


def test_of_an_older_one_nothing_is_guessed_that_decides_what_comes_out(tmp_path):
    (tmp_path / "config.toml").write_bytes(older(perception=("lifter",), render=("prefetch",)))
    with pytest.raises(InvalidConfig, match=r"or an older version .* it lacks perception\.lifter;"):
        load_resolved_config(tmp_path / "config.toml")


def test_a_summary_that_lacks_whether_it_is_complete_ends_no_training(tmp_path):
    run = make_run(tmp_path)
    summary = {
        "steps": 1,
        "episodes": 1,
        "updates": 1,
        "seconds": 1.0,
        "steps_per_second": 1.0,
        "stages": {},
        "late_replies": 0,
        "retries": 0,
    }
    run.summary_path.write_bytes(msgspec.json.encode(summary))
    assert not run.is_trained()
    run.summary_path.write_bytes(msgspec.json.encode(summary | {"complete": True}))
    assert run.is_trained()


def test_a_plan_that_is_damaged_is_no_plan_to_evaluate(tmp_path):
    run = make_run(tmp_path)
    (run.path / "plan.json").write_bytes(b"{}")
    with pytest.raises(DamagedRecord, match=r"plan\.json is damaged: it lacks evaluate"):
        run.plan()
