"""The command with real renders, the real network and real fits: killed, and gone on with."""

import json

import pyarrow.parquet as pq
import pytest

from orchestrator.experiments.next_view.directory import NextViewDirectory

pytestmark = pytest.mark.slow

PATIENCE = 280.0
CONFIG = "[environment.camera]\nwidth = 320\nheight = 240\n"
SMALL = ("experiment", "next-view", "small.toml", "--train", "1", "--test", "1", "--trainings", "1", "--workers", "1")


def test_a_killed_experiment_goes_on_to_scores_of_every_way_of_choosing(orchestrator, wait_until):
    (orchestrator.folder / "small.toml").write_text(CONFIG)
    directory = NextViewDirectory(orchestrator.folder / "e")
    child = orchestrator.start(*SMALL, "--out", "e", rooms=None)
    wait_until(lambda: any(directory.table_path.with_suffix(".parts").glob("part-*")))
    child.kill()
    child.communicate(timeout=PATIENCE)

    done = orchestrator.run(*SMALL, "--out", "e", "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    scores = json.loads(done.stdout)
    assert (scores["train"] + scores["test"] + scores["undecided"], scores["people"]) == (2, 1)
    assert {way["group"] for way in scores["ways"]} == {"thesis", "memory", "map", "bound", "baseline"}
    assert "| joints and quality [72, 64, 8] | 1 |" in directory.page_path.read_text(encoding="utf-8")
    assert (directory.plots / "next-view.png").is_file()
    table = pq.read_table(directory.table_path)
    assert table["split"].to_pylist() == ["test"] * 9 + ["train"] * 9
    assert [picture is not None for picture in table["picture"].to_pylist()] == [camera == 4 for camera in range(9)] * 2

    other = orchestrator.run(*SMALL, "--out", "e", "--spacing", "0.5", rooms=None)
    assert other.returncode == 2
    assert "other views" in other.stderr
