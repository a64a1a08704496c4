"""The command with the rooms that it is made for: real renders, the real network, a learning agent."""

import json
import os
import signal

import cv2
import pytest

from orchestrator.run.run_directory import RunDirectory

pytestmark = pytest.mark.slow

TINY = """
[environment]
num_envs = 2
episode_steps = 8

[learner.sac]
batch_size = 8

[training]
steps = 16
prefill = 16
log_every = 8

[evaluation]
episodes = 2
baselines = ["stay"]
"""
PATIENCE = 240.0


def test_a_training_on_real_renders_ends_with_its_evaluation(orchestrator):
    (orchestrator.folder / "tiny.toml").write_text(TINY)
    done = orchestrator.run("train", "tiny.toml", "--run", "tiny", "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["steps"], report["interrupted"]) == (16, False)
    assert all(seconds > 0 for seconds in report["stages"].values()), report["stages"]
    scores = {score["policy"]: score for score in report["evaluation"]["scores"]}
    assert set(scores) == {"sac", "stay"}
    assert all(score["episodes"] == 2 for score in scores.values())
    run = orchestrator.folder / "tiny"
    assert {path.name for path in run.iterdir()} >= {
        "config.toml",
        "versions.json",
        "workers.json",
        "logs",
        "tensorboard",
        "progress.jsonl",
        "episodes.jsonl",
        "summary.json",
        "weights.safetensors",
        "evaluation.json",
    }
    assert list(orchestrator.temporary.glob("vantage-*")) == []


def test_a_real_training_goes_on_after_a_worker_the_agent_and_the_orchestrator_were_killed(orchestrator, wait_until):
    # Long enough to be under way for some seconds, whatever the machine.
    (orchestrator.folder / "tiny.toml").write_text(TINY.replace("steps = 16\n", "steps = 400\ncheckpoint_every = 8\n"))
    child = orchestrator.start("train", "tiny.toml", "--run", "tiny", "--no-evaluate", rooms=None)
    run = RunDirectory(orchestrator.folder / "tiny")

    def steps_trained() -> int:
        progress = run.progress()
        return progress.step if progress and progress.phase == "training" else 0

    def pid(name: str) -> int:
        return next(process.pid for process in run.processes() if process.name == name)

    def kill(name: str) -> None:
        os.kill(pid(name), signal.SIGKILL)

    wait_until(lambda: run.progress() is not None)
    kill("render-0")
    wait_until(lambda: steps_trained() >= 8)
    agent = pid("agent")
    kill("agent")
    wait_until(lambda: pid("agent") != agent)
    child.kill()
    child.communicate(timeout=PATIENCE)
    done = orchestrator.run("resume", "tiny", "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["steps"], report["restarts"], report["evaluation"]) == (400, {"agent": 1, "render-0": 1}, None)
    assert orchestrator.alive() == set()


def test_a_page_of_a_real_scene_has_people_and_colours(orchestrator):
    done = orchestrator.run("view", "2", "--size", "320x240", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    page = cv2.imread(str(orchestrator.folder / "scene-2.png"))
    assert page.shape[0] > 1000
    assert page.std() > 40
    crowd = ("--bystanders", "2", "--output", "crowd.png")
    done = orchestrator.run("view", "2", "--size", "320x240", *crowd, rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    crowded = cv2.imread(str(orchestrator.folder / "crowd.png"))
    assert (crowded != page).any(axis=2).mean() > 0.01


def test_a_machine_that_passes_these_tests_is_healthy(orchestrator):
    done = orchestrator.run("doctor", "--json", rooms=None, patience=PATIENCE)
    failed = [check for check in json.loads(done.stdout) if not check["passed"] and check["needed"]]
    assert (done.returncode, failed) == (0, [])
