"""What all commands have in common: refusals, exit codes and help."""

import pytest

from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.views import ViewSet
from protocol.config import RunConfig
from protocol.config_file import load_config
from tests.orchestrator.cli.conftest import SHORT


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("train", "short.toml", "--join", "tcp://host:5600"), "there is no key: make one by 'orchestrator keys new'"),
        (("train", "short.toml", "--join", "nowhere"), "'nowhere' is not an address"),
        (("train", "short.toml", "--join", "tcp://host:5600", "--key", "a.key"), "can't read the key"),
        (("host",), "tcp://0.0.0.0:5600 can be reached from other machines, and there is no key"),
        (("host", "--bind", "nowhere"), "'nowhere' is not an address"),
        (("host", "--key", "a.key"), "can't read the key"),
    ],
)
def test_what_can_not_be_spoken_with_is_told_before_a_run_is_made(invoke, tmp_path, arguments, said):
    (tmp_path / "short.toml").write_text(SHORT)
    done = invoke(*arguments)
    assert (done.exit_code, said in done.stderr) == (1, True), done.stderr
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    "command",
    [("experiment", "qoe"), ("experiment", "flights", "e"), ("experiment", "grid", "build"), ("lifter", "fit")],
)
def test_a_number_of_workers_has_no_meaning_where_a_host_s_are_joined(invoke, tmp_path, command):
    if "flights" in command:
        ExperimentDirectory.open_for(tmp_path / "e", RunConfig(), ViewSet(frames=1))
    done = invoke(*command, "--workers", "2", "--join", "tcp://host:5600")
    assert (done.exit_code, "--workers sets how many workers to start here" in done.stderr) == (2, True), done.stderr
    assert not (tmp_path / "runs").exists()


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
        ("host", "--key", "host.key", "--insecure"),
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
        ("experiment", "grid", "build"),
        ("experiment", "grid", "check"),
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
