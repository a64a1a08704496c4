"""What was done stands in the records: files' times, clocks and folders say nothing."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from orchestrator.run.run_directory import RunDirectory
from tests.orchestrator.conftest import Command

CONFIG = """
[perception]
network = "mine.onnx"

[timeouts]
heartbeat = 0.1

[training]
steps = 3

[evaluation]
episodes = 2
baselines = ["stay"]
"""

pytestmark = pytest.mark.slow

PATIENCE = 120.0


class Finished:
    """A run that was trained and evaluated, in the place where it was made."""

    def __init__(self, command: Command) -> None:
        self.command = command
        self.config = command.folder / "mine" / "short.toml"
        self.config.parent.mkdir()
        self.network.write_bytes(b"a network")
        self.config.write_text(CONFIG)
        self.run = RunDirectory(command.folder / "one")
        self.report = self.call("train", str(self.config), "--run", "one", "--json")

    @property
    def network(self) -> Path:
        return self.config.parent / "mine.onnx"

    def call(self, *arguments: str) -> dict:
        done = self.command.run(*arguments, patience=PATIENCE)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def refusal(self, *arguments: str) -> str:
        """What a command says that is refused for what it was given."""
        done = self.command.run(*arguments, patience=PATIENCE)
        assert done.returncode == 2, done.stderr
        assert "Traceback" not in done.stderr
        return " ".join(done.stderr.split())


@pytest.fixture
def finished(orchestrator: Command) -> Finished:
    return Finished(orchestrator)


def content(folder: Path, *, logs: bool = True) -> dict[str, bytes]:
    """All that a run is, with or without what the orchestrator says of its own doings."""
    files = (path for path in folder.rglob("*") if path.is_file() and (logs or path.parent.name != "logs"))
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def copied_file_by_file(folder: Path, to: Path, times: float | None = None) -> Path:
    """Copied so that its files have the copy's times, or others."""
    shutil.copytree(folder, to, copy_function=shutil.copyfile)
    for path in to.rglob("*"):
        if times is not None:
            os.utime(path, (times, times))
    return to


@pytest.mark.parametrize("times", [None, 1.0, 4e9], ids=["now", "long ago", "in the future"])
def test_a_copied_run_keeps_its_evaluation(finished, times):
    finished.call("evaluate", "one", "--episodes", "5", "--json")
    copy = copied_file_by_file(finished.run.path, finished.command.folder / "copy", times)
    before = content(copy)
    report = finished.call("resume", "copy", "--json")
    assert [score["episodes"] for score in report["evaluation"]["scores"]] == [5, 5]
    assert content(copy) == before


def test_an_evaluation_is_done_once_it_is_written_whatever_time_a_file_server_gives_it(orchestrator):
    room = orchestrator.folder / "a_clock_of_its_own"
    room.mkdir()
    # Python runs this at every start: what is put in place is a minute behind our clock, as on a server behind.
    (room / "sitecustomize.py").write_text(
        "import os, pathlib, time\n"
        "replace = pathlib.Path.replace\n"
        "def place(self, target):\n"
        "    behind = time.time() - 60.0\n"
        "    os.utime(self, (behind, behind))\n"
        "    return replace(self, target)\n"
        "pathlib.Path.replace = place\n"
    )
    paths = [str(room), os.environ.get("PYTHONPATH", "")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(paths))
        finished = Finished(orchestrator)
    assert finished.report["restarts"] == {}
    assert finished.report["evaluation"] is not None


def test_an_evaluation_asked_for_again_is_flown_again_and_says_who_did_it(finished):
    before = finished.run.evaluation()
    finished.call("evaluate", "one", "--json")
    after = finished.run.evaluation()
    assert before is not None
    assert after is not None
    assert after.weights == before.weights
    assert after.by != before.by


def test_a_finished_run_says_that_it_is_and_a_copy_says_the_same(finished):
    copied_file_by_file(finished.run.path, finished.command.folder / "copy", times=4e9)
    for path in ("one", "copy"):
        status = finished.call("status", path, "--json")
        assert (status["state"], status["is_finished"], status["reason"]) == ("finished", True, None)
        said = finished.command.run("status", path)
        assert said.returncode == 0
        assert "trained 3 steps" in said.stdout
        assert "evaluation 3/" not in said.stdout


def test_a_run_that_cant_go_on_says_why_and_how_it_would(finished):
    finished.run.summary_path.unlink()
    finished.command.run("resume", "one", rooms=("render_crashes_at_start",), patience=PATIENCE)
    status = finished.call("status", "one", "--json")
    assert status["state"] == "failed"
    assert "render-0 was killed by SIGABRT: out of paint" in status["reason"]
    assert "orchestrator resume one" in finished.command.run("status", "one").stdout
    finished.call("resume", "one", "--json")
    assert finished.call("status", "one", "--json")["state"] == "finished"


def test_a_finished_run_on_a_disk_that_cant_be_written_to_is_told_of(finished):
    path = finished.run.path
    bind = f"mount --bind {path} {path} && mount -o remount,bind,ro {path}"
    for command in ("status", "resume"):
        call = ["unshare", "--mount", "sh", "-c", f'{bind} && exec "$@"', "sh"]
        if subprocess.run([*call, "true"], capture_output=True, check=False).returncode != 0:
            pytest.skip("not run: no right to a mount of its own")
        orchestrate = [sys.executable, "-m", "orchestrator", command, "one", "--json"]
        done = subprocess.run(
            [*call, *orchestrate], cwd=finished.command.folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["evaluation"] == finished.report["evaluation"]


@pytest.mark.parametrize("command", [("resume", "one"), ("evaluate", "one")], ids=lambda command: command[0])
def test_nothing_goes_on_with_another_network(finished, command):
    finished.network.write_bytes(b"another network")
    before = content(finished.run.path)
    assert "perception.network: the network is another one" in finished.refusal(*command)
    finished.network.unlink()
    assert f"the network {finished.network} is missing" in finished.refusal(*command)
    assert content(finished.run.path) == before


def test_nothing_goes_on_or_resumes_with_another_network_of_the_same_name(finished):
    # Where commands are called there is another one of that name, and it is none of the configuration's.
    (finished.command.folder / "mine.onnx").write_bytes(b"another network")
    train_again = ("train", str(finished.config), "--run", "one", "--or-resume")
    finished.call(*train_again, "--json")
    finished.network.write_bytes(b"another network")
    assert "the network is another one" in finished.refusal(*train_again)


def test_a_network_that_is_not_there_makes_no_run(finished):
    finished.network.unlink()
    sentence = finished.refusal("train", str(finished.config), "--run", "two")
    assert f"perception.network: there is no file {finished.network}" in sentence
    assert not (finished.command.folder / "two").exists()


@pytest.mark.parametrize("name", ["config.toml", "plan.json", "versions.json"])
@pytest.mark.parametrize("command", [("resume", "one"), ("evaluate", "one")], ids=lambda command: command[0])
def test_nothing_goes_on_with_what_a_power_cut_has_emptied(finished, command, name):
    (finished.run.path / name).write_bytes(b"")
    before = content(finished.run.path)
    assert f"{name} is damaged" in finished.refusal(*command)
    assert content(finished.run.path) == before
