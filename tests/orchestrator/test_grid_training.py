"""The command on the grid, with the real agent: no workers, no renders."""

import json
import os
import signal

import pytest

from orchestrator.run.run_directory import RunDirectory
from tests.agent.environment.grid.tables import table, write_to
from tests.agent.test_grid_runs import CONFIG

pytestmark = pytest.mark.slow

PATIENCE = 120.0


@pytest.fixture
def config(orchestrator):
    views = write_to(orchestrator.folder / "views.msgpack", table())
    path = orchestrator.folder / "grid.toml"
    path.write_text(CONFIG.format(table=views.name))
    return path


def test_a_training_needs_no_workers_and_ends_with_its_evaluation(orchestrator, config):
    done = orchestrator.run("train", "grid.toml", "--run", "grid", "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["steps"], report["interrupted"]) == (800, False)
    assert report["evaluation"]["scores"][0]["policy"] == "recurrent_ppo"
    run = RunDirectory(orchestrator.folder / "grid")
    assert {process.role.value for process in run.processes()} == {"agent"}
    printed = orchestrator.run("experiment", "grid", "evaluate", "grid", "--json", rooms=None, patience=PATIENCE)
    assert json.loads(printed.stdout)["thresholds"][0]["threshold"] == 1.5
    again = orchestrator.run("experiment", "grid", "evaluate", "grid", rooms=None, patience=PATIENCE)
    assert "of the environments can be solved" in again.stdout


def test_a_killed_agent_goes_on(orchestrator, config, wait_until):
    config.write_text(config.read_text().replace("steps = 800", "steps = 4000"))
    child = orchestrator.start("train", "grid.toml", "--run", "grid", "--no-evaluate", rooms=None)
    run = RunDirectory(orchestrator.folder / "grid")
    wait_until(lambda: (progress := run.progress()) is not None and progress.step > 0)
    os.kill(next(process.pid for process in run.processes() if process.name == "agent"), signal.SIGKILL)
    _, errors = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0, errors
    assert run.summary().steps == 4000
    assert [restart.process for restart in run.restarts()] == ["agent"]


def test_variants_are_trained_side_by_side_and_compared(orchestrator, config):
    command = ("experiment", "grid", "train", "grid.toml", "--out", "out", "--seeds", "2", "--jobs", "2")
    for variant in ("quality", "binary"):
        command += ("--variant", variant)
    done = orchestrator.run(*command, "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["runs"] == [
        f"out/{variant}-seed-{seed}" for seed in (5, 6) for variant in ("quality", "binary")
    ]
    report = orchestrator.run("experiment", "grid", "report", "out", "--json", rooms=None, patience=PATIENCE)
    assert report.returncode == 0, report.stderr
    first = json.loads(report.stdout)["thresholds"][0]
    assert [(one["policy"], one["seeds"]) for one in first["policies"]][:2] == [("quality", 2), ("binary", 2)]
    out = orchestrator.folder / "out"
    assert {path.name for path in (out / "plots").iterdir()} == {"curves.png", "maps.png"}
    assert "| **reward by quality** | 2 |" in (out / "figures.md").read_text()


def test_a_training_that_fails_ends_the_others_and_is_named(orchestrator, config):
    config.write_text(config.read_text().replace("views.msgpack", "missing.msgpack"))
    command = ("experiment", "grid", "train", "grid.toml", "--out", "out", "--variant", "quality")
    done = orchestrator.run(*command, rooms=None, patience=PATIENCE)
    assert done.returncode != 0
    assert "missing.msgpack" in done.stderr
