"""The command with real renders and the real network: killed, gone on with, and checked."""

import json
import re

import numpy as np
import pytest

from orchestrator.experiments.grid.directory import GridDirectory
from protocol.grid.table import CENTRE, read_table

pytestmark = pytest.mark.slow

PATIENCE = 240.0
SMALL = """
[environment.camera]
width = 128
height = 96
[perception]
input_height = 64
input_width = 88
"""
BUILD = ("experiment", "grid", "build", "small.toml", "--profile=thesis", "--train=1", "--test=1", "--out=g", "--json")


def test_a_killed_build_goes_on_to_the_bytes_that_its_recipe_gives(orchestrator, wait_until):
    (orchestrator.folder / "small.toml").write_text(SMALL)
    directory = GridDirectory(orchestrator.folder / "g")
    first = directory.all_views_path.with_suffix(".parts") / "part-00000.parquet"
    child = orchestrator.start(*BUILD, "--workers", "1", rooms=None)
    wait_until(first.exists)
    child.kill()
    child.communicate(timeout=PATIENCE)
    assert not directory.table_path.exists()

    done = orchestrator.run(*BUILD, "--workers", "2", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    counts = [int(count) for count in re.findall(r"(\d+)/720 frames", done.stderr)]
    assert min(counts) >= 360
    assert [one["environments"] for one in json.loads(done.stdout)["splits"]] == [1, 1]

    table = read_table(directory.table_path)
    found = np.isfinite(table.quantities["error"]).any(axis=2)
    assert found.any(axis=1).all()
    assert not found[:, CENTRE].any()

    checked = orchestrator.run("experiment", "grid", "check", str(directory.table_path), "--json", rooms=None)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert [one["same"] for one in json.loads(checked.stdout)["environments"]] == [True, True]
