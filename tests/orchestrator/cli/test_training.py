"""`train` with real processes; only the rooms that it starts are stand-ins."""

import json
import os
import signal

import psutil
import pytest

from orchestrator.run.run_directory import Plan, RunDirectory
from orchestrator.run.versions import collect_versions
from protocol.config_file import load_config
from tests.orchestrator.cli.conftest import LONG, SHORT


def processes_of(run) -> list[int]:
    return [record["pid"] for record in json.loads((run / "workers.json").read_text())]


def gone(pid: int) -> bool:
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


@pytest.mark.slow
def test_train_makes_a_run_trains_and_prints_its_report_as_json(orchestrator, config):
    done = orchestrator.run("train", config(SHORT), "--run", "runs/one", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["run"], report["steps"], report["interrupted"]) == ("runs/one", 20, False)
    assert set(report["stages"]) == {"render", "infer", "decode", "lift", "qoe", "filter", "transport", "learn"}
    assert [score["policy"] for score in report["evaluation"]["scores"]] == ["trained", "stay"]
    assert "waiting for render-0, perception-0" in done.stderr
    assert "nothing will be learned" in done.stderr
    run = orchestrator.folder / "runs" / "one"
    assert {path.name for path in run.iterdir()} >= {"config.toml", "versions.json", "workers.json", "logs"}
    assert {path.name for path in (run / "logs").iterdir()} == {
        "render-0.jsonl",
        "perception-0.jsonl",
        "agent.jsonl",
        "evaluation.jsonl",
        "orchestrator.jsonl",
    }
    assert load_config(run / "config.toml").training.steps == 20
    assert all(map(gone, processes_of(run)))
    assert list(orchestrator.temporary.iterdir()) == []

    again = orchestrator.run("train", config(SHORT), "--run", "runs/one")
    assert again.returncode == 1
    assert "runs/one exists already, and a run is never overwritten" in again.stderr
    assert "'orchestrator resume runs/one'" in again.stderr

    table = orchestrator.run("evaluate", "runs/one", "--episodes", "7", "--policy", "random")
    assert table.returncode == 0, table.stderr
    assert "7 flights" in table.stdout
    assert "random" in table.stdout

    status = orchestrator.run("status", "--json")
    assert (json.loads(status.stdout)["state"], json.loads(status.stdout)["phase"]) == ("finished", "evaluation")


@pytest.mark.slow
def test_without_an_evaluation_a_training_ends_after_its_last_step(orchestrator, config):
    done = orchestrator.run("train", config(SHORT), "--no-evaluate")
    assert done.returncode == 0, done.stderr
    assert "trained 20 steps" in done.stdout
    [run] = (orchestrator.folder / "runs").iterdir()
    assert run.name.startswith("short-")
    assert not (run / "evaluation.json").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_a_signal_ends_a_training_in_order_and_no_process_is_left(orchestrator, config, wait_until, number):
    child = orchestrator.start("train", config(LONG), "--run", "one", "--json")
    run = orchestrator.folder / "one"
    wait_until(lambda: (run / "progress.jsonl").exists() and child.poll() is None)
    busy = orchestrator.run("evaluate", "one")
    assert (busy.returncode, "another orchestrator works on one" in busy.stderr) == (1, True)
    pids = processes_of(run)
    assert len(pids) == 3
    os.kill(child.pid, number)
    out, err = child.communicate(timeout=30)
    assert child.returncode == 130, err
    report = json.loads(out)
    assert report["interrupted"]
    assert report["steps"] > 0
    assert (run / "weights.safetensors").exists()
    assert all(map(gone, pids))
    assert list(orchestrator.temporary.iterdir()) == []


@pytest.mark.slow
def test_a_signal_before_the_training_has_begun_ends_the_workers(orchestrator, config, wait_until):
    child = orchestrator.start("train", config(LONG), "--run", "one", rooms=("render_never_gets_ready",))
    run = orchestrator.folder / "one"
    wait_until(lambda: (run / "workers.json").exists() and len(processes_of(run)) == 2)
    os.kill(child.pid, signal.SIGINT)
    out, err = child.communicate(timeout=30)
    assert (child.returncode, out) == (130, ""), err
    assert all(map(gone, processes_of(run)))


@pytest.mark.slow
def test_a_worker_that_dies_at_the_start_is_quoted_and_everything_stops(orchestrator, config):
    done = orchestrator.run("train", config(LONG), "--run", "one", rooms=("render_dies_at_start",))
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.splitlines()[-2:] == [
        "render-0 ended with exit code 2: no EGL display; install libegl1 (log: one/logs/render-0.jsonl)",
        "continue the run by 'orchestrator resume one'",
    ]
    assert all(map(gone, processes_of(orchestrator.folder / "one")))


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("[training]\nstepps = 3\n", "stepps"),
        ("[training]\nsteps = 'many'\n", "training.steps"),
        ("[environment]\nbeta = 0.5\n", "environment.beta"),
        ("seed = 'x'\n", "seed"),
        ("steps = [", "short.toml"),
    ],
)
def test_a_wrong_configuration_names_the_field_and_exits_with_2(invoke, tmp_path, text, field):
    (tmp_path / "short.toml").write_text(text)
    done = invoke("train", "short.toml")
    assert done.exit_code == 2
    assert field in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "runs").exists()


def test_a_configuration_that_is_not_there_exits_with_2(invoke):
    done = invoke("train", "nowhere.toml")
    assert (done.exit_code, "can't read the configuration nowhere.toml" in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--or-resume",), "needs --run"),
        (("--key", "trainer.key"), "they need --join"),
        (("--join", "tcp://host:5600", "--key", "trainer.key", "--insecure"), "leave out --key, or --insecure"),
    ],
)
def test_options_that_make_no_sense_together_exit_with_2_before_a_run_is_made(invoke, tmp_path, options, said):
    (tmp_path / "short.toml").write_text(SHORT)
    done = invoke("train", "short.toml", *options)
    assert (done.exit_code, said in done.stderr) == (2, True)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(("planned", "option"), [(True, "--no-evaluate"), (False, "--evaluate")])
def test_whether_a_run_ends_with_an_evaluation_is_not_changed_when_it_goes_on(invoke, tmp_path, planned, option):
    config = tmp_path / "short.toml"
    config.write_text(SHORT)
    RunDirectory.create(tmp_path / "one", load_config(config), collect_versions({}), Plan(evaluate=planned))
    done = invoke("train", "short.toml", "--run", "one", "--or-resume", option)
    assert (done.exit_code, f"{option}: one was made with" in done.stderr) == (2, True), done.stderr


def test_an_existing_run_is_refused_before_anything_starts(invoke, tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    (tmp_path / "one").mkdir()
    done = invoke("train", "short.toml", "--run", "one")
    assert done.exit_code == 1
    assert "one exists already, and a run is never overwritten" in done.stderr
    assert list((tmp_path / "one").iterdir()) == []
