"""The command with real renders and the real network: stopped, killed, gone on with."""

import json
import signal

import pyarrow.parquet as pq
import pytest

from orchestrator.experiments.directory import ExperimentDirectory

pytestmark = pytest.mark.slow

PATIENCE = 240.0
CONFIG = "[environment.camera]\nwidth = 320\nheight = 240\n"
SMALL = ("experiment", "qoe", "small.toml", "--frames", "12", "--workers", "1", "--frames-a-part", "4")


def test_a_killed_experiment_goes_on_to_the_table_of_an_untouched_one(orchestrator, wait_until):
    (orchestrator.folder / "small.toml").write_text(CONFIG)
    killed = ExperimentDirectory(orchestrator.folder / "killed")
    parts = killed.table_path.with_suffix(".parts")
    child = orchestrator.start(*SMALL, "--out", "killed", rooms=None)
    wait_until(lambda: (parts / "part-00000.parquet").exists())
    child.kill()
    child.communicate(timeout=PATIENCE)
    begun = (parts / "part-00000.parquet").stat().st_mtime_ns
    assert not killed.table_path.exists()

    child = orchestrator.start(*SMALL, "--out", "killed", rooms=None)
    wait_until(lambda: (parts / "part-00001.parquet").exists())
    assert (parts / "part-00000.parquet").stat().st_mtime_ns == begun
    child.send_signal(signal.SIGINT)
    _, words = child.communicate(timeout=PATIENCE)
    assert (child.returncode, "stopped on request" in words) == (130, True), words

    done = orchestrator.run(*SMALL, "--out", "killed", "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["qoe"]["frames"] == 12
    untouched = orchestrator.run(*SMALL, "--out", "untouched", rooms=None, patience=PATIENCE)
    assert untouched.returncode == 0, untouched.stderr
    assert killed.table_path.read_bytes() == (orchestrator.folder / "untouched" / "qoe.parquet").read_bytes()
    assert not parts.exists()
    table = pq.read_table(killed.table_path)
    assert table.num_rows == 12 * 2 * 18
    assert table["located"].to_numpy().mean() > 0.3


def test_another_experiment_in_the_same_directory_is_refused_before_anything_starts(orchestrator):
    first = orchestrator.run("experiment", "qoe", "--frames", "1", "--noise", "none", "--out", "e", rooms=None)
    assert first.returncode == 0, first.stderr
    other = orchestrator.run("experiment", "qoe", "--frames", "1", "--seed", "1", "--out", "e", rooms=None)
    assert other.returncode == 2
    assert "other views" in other.stderr
