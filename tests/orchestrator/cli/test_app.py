"""The whole command with real processes; only the rooms that it starts are stand-ins."""

import json
import os
import signal

import psutil
import pytest
from typer.testing import CliRunner

from orchestrator.cli.app import app
from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.views import ViewSet
from orchestrator.run.run_directory import Plan, RunDirectory
from orchestrator.run.versions import collect_versions
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.messages import Role
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint
from tests.serving import serving

SHORT = "[training]\nsteps = 20\n[evaluation]\nepisodes = 3\nbaselines = ['stay']\n"
LONG = "[training]\nsteps = 1000000\n"


@pytest.fixture
def config(orchestrator):
    def write(text: str) -> str:
        path = orchestrator.folder / "short.toml"
        path.write_text(text)
        return str(path)

    return write


@pytest.fixture
def invoke(monkeypatch, tmp_path):
    """Calls the command within this process: for what ends before it starts any other."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path / "cache"))
    return lambda *arguments: CliRunner().invoke(app, list(arguments))


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
def test_a_signal_ends_a_training_in_order_and_nobody_is_left(orchestrator, config, wait_until, number):
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
        "go on with the run by 'orchestrator resume one'",
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
        (("--or-resume",), "it needs --run"),
        (("--key", "trainer.key"), "they need --join"),
        (("--join", "tcp://hub:5600", "--key", "trainer.key", "--insecure"), "leave out --key, or --insecure"),
    ],
)
def test_options_that_make_no_sense_together_exit_with_2_before_a_run_is_made(invoke, tmp_path, options, said):
    (tmp_path / "short.toml").write_text(SHORT)
    done = invoke("train", "short.toml", *options)
    assert (done.exit_code, said in done.stderr) == (2, True)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("train", "short.toml", "--join", "tcp://hub:5600"), "there is no key: make one by 'orchestrator keys new'"),
        (("train", "short.toml", "--join", "hub"), "'hub' is not an address"),
        (("train", "short.toml", "--join", "tcp://hub:5600", "--key", "a.key"), "can't read the key"),
        (("host",), "tcp://0.0.0.0:5600 can be reached from other machines, and there is no key"),
        (("host", "--bind", "hub"), "'hub' is not an address"),
        (("host", "--key", "a.key"), "can't read the key"),
    ],
)
def test_what_can_not_be_spoken_with_is_told_before_a_run_is_made(invoke, tmp_path, arguments, said):
    (tmp_path / "short.toml").write_text(SHORT)
    done = invoke(*arguments)
    assert (done.exit_code, said in done.stderr) == (1, True), done.stderr
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("command", [("experiment", "qoe"), ("experiment", "flights", "e"), ("lifter", "fit")])
def test_a_number_of_workers_has_no_meaning_where_a_host_s_are_joined(invoke, tmp_path, command):
    if "flights" in command:
        ExperimentDirectory.open_for(tmp_path / "e", RunConfig(), ViewSet(frames=1))
    done = invoke(*command, "--workers", "2", "--join", "tcp://hub:5600")
    assert (done.exit_code, "--workers are those that are started here" in done.stderr) == (2, True), done.stderr
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


@pytest.mark.slow
def test_view_draws_a_page_for_each_scene(orchestrator):
    done = orchestrator.run("view", "3", "4", "--angle", "20", "--output", "pictures")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["pictures/scene-3.png", "pictures/scene-4.png"]
    assert all((orchestrator.folder / path).stat().st_size > 10_000 for path in done.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("evaluate", "nowhere"), "nowhere is no run directory"),
        (("resume", "nowhere"), "nowhere is no run directory"),
        (("status",), "there is no run in runs yet"),
        (("status", "nowhere"), "nowhere is no run directory"),
    ],
)
def test_a_run_that_is_not_there_is_said_to_be_so(invoke, arguments, said):
    done = invoke(*arguments)
    assert (done.exit_code, done.stdout) == (1, "")
    assert said in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("view", "1", "--size", "big"),
        ("view", "1", "--bystanders", "9"),
        ("view", "1", "2", "--output", "a.png"),
        ("host", "--key", "hub.key", "--insecure"),
        ("host", "--allowed", "allowed.json"),
    ],
)
def test_wrong_arguments_exit_with_2_before_anything_starts(invoke, tmp_path, arguments):
    assert invoke(*arguments).exit_code == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [
        (),
        ("train",),
        ("resume",),
        ("host",),
        ("evaluate",),
        ("status",),
        ("doctor",),
        ("view",),
        ("models", "pull"),
        ("bodies", "bake"),
        ("calibration", "fit"),
        ("calibration", "show"),
        ("experiment", "qoe"),
    ],
)
def test_every_command_has_help_with_examples(invoke, command):
    shown = invoke(*command, "--help")
    assert shown.exit_code == 0
    assert f"orchestrator {' '.join(command)}".strip() in shown.output.split("Examples:")[1]


def test_every_configuration_that_we_ship_can_be_read(request):
    configs = sorted((request.config.rootpath / "configs").glob("*.toml"))
    assert {path.name for path in configs} >= {"quickstart.toml", "full.toml"}
    assert all(isinstance(load_config(path), RunConfig) for path in configs)


class TestStatusOverHttp:
    def test_who_is_ready_is_told_and_ends_with_0(self, invoke, tmp_path):
        at = free_endpoint()
        about = About(role=Role.RENDER, name="render-7")
        with (
            worker_telemetry(at, about) as observer,
            serving({}, f"ipc://{tmp_path}/r", role=Role.RENDER, observer=observer),
        ):
            wait_until(lambda: invoke("status", "--http", str(at)).exit_code == 0)
            told = json.loads(invoke("status", "--http", str(at), "--json").stdout)
        assert [(one["at"], one["ready"], one["info"]["name"]) for one in told] == [(str(at), True, "render-7")]

    def test_where_nobody_is_that_is_told_and_ends_with_1(self, invoke):
        done = invoke("status", "--http", str(free_endpoint()))
        assert done.exit_code == 1
        assert "nobody answers" in done.stdout

    def test_a_run_and_processes_at_once_are_a_mistake(self, invoke):
        assert invoke("status", "runs/x", "--http", "8000").exit_code == 2
