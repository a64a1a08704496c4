import os
from datetime import datetime
from pathlib import Path

import pytest
from msgspec.structs import replace

from orchestrator.errors import NoSuchRun
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.runs import default_run_path, newest_run
from protocol.config import RunConfig


def test_the_newest_run_is_the_one_that_was_made_last_whenever_its_files_were_written(tmp_path, versions):
    for name, made in (("b", 20.0), ("a", 30.0), ("c", 0.0)):
        RunDirectory.create(tmp_path / name, RunConfig(), replace(versions, made=made))
        os.utime(tmp_path / name / "config.toml", (100.0 - made, 100.0 - made))
    assert newest_run(tmp_path).path == tmp_path / "a"


def test_of_runs_that_do_not_say_when_they_were_made_the_last_by_name_is_taken(tmp_path, versions):
    for name in ("full-20261121-080000", "full-20261122-080000", "full-20261120-080000"):
        RunDirectory.create(tmp_path / name, RunConfig(), replace(versions, made=0.0))
    assert newest_run(tmp_path).name == "full-20261122-080000"


def test_without_runs_there_is_no_newest_one(tmp_path):
    with pytest.raises(NoSuchRun, match="orchestrator train"):
        newest_run(tmp_path / "runs")


def test_a_run_is_named_after_its_configuration_and_the_time():
    assert default_run_path(Path("configs/full.toml"), datetime(2026, 11, 22, 9, 5, 7)) == Path(
        "runs/full-20261122-090507"
    )
