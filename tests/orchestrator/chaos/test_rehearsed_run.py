import os
import subprocess
import sys

import pytest

from orchestrator.chaos.errors import NotRecovered, RehearsalFailed
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.children import MARK, marked
from orchestrator.run.socket_directory import sockets_of
from protocol.config import TimeoutsConfig
from protocol.errors import Interrupted
from protocol.messages import Role
from protocol.system.stop_request import StopRequest


@pytest.mark.slow
def test_an_orchestrator_that_gives_up_is_quoted(tmp_path):
    config = tmp_path / "c.toml"
    config.write_text("[training]\nstepps = 3\n")
    with RehearsedRun(config, tmp_path / "run", TimeoutsConfig(), StopRequest(), lambda _: None) as run:
        run.begin()
        with pytest.raises(
            RehearsalFailed, match=r"orchestrator ended with exit code 2: .*stepps.* \(log: .*run\.log\)"
        ):
            run.finish()


def test_what_does_not_come_in_time_is_named(rehearsed):
    with pytest.raises(NotRecovered, match="was there has not come within"):
        rehearsed.wait(
            lambda: bool(rehearsed.children.alive(Role.RENDER)), "a process for render was there", patience=0.1
        )


def test_a_request_to_stop_ends_every_wait(tmp_path, rehearsed):
    stop = StopRequest()
    with RehearsedRun(tmp_path / "c.toml", tmp_path / "other", TimeoutsConfig(), stop, lambda _: None) as run:
        stop.ask()
        with pytest.raises(Interrupted):
            run.sleep(600.0)


def test_whoever_looks_is_shown_the_run(tmp_path):
    shown = []
    with RehearsedRun(tmp_path / "c.toml", tmp_path / "run", TimeoutsConfig(), StopRequest(), shown.append) as run:
        run.look()
    assert shown == [run]


def test_at_its_end_nothing_is_left_of_a_run_but_its_files(rehearsed):
    mark = str(rehearsed.directory.path.resolve())
    command = (sys.executable, "-c", "import time; time.sleep(600)")
    left = subprocess.Popen(command, env=os.environ | {MARK: mark})
    sockets = sockets_of(rehearsed.directory.path)
    sockets.mkdir(mode=0o700)
    rehearsed.failpoints.order("checkpoint-opened", "kill")
    rehearsed.close()
    left.wait(30)
    assert list(marked(mark)) == []
    assert not sockets.exists()
    assert not rehearsed.failpoints.is_pending("checkpoint-opened")
    assert rehearsed.directory.config_path.exists()


def test_a_process_of_the_same_name_is_a_successor_only_if_it_is_another(rehearsed, start):
    first = start("render-0", Role.RENDER)
    assert rehearsed.successor(first) is None
    second = start("render-0", Role.RENDER)
    assert rehearsed.successor(first) == second
