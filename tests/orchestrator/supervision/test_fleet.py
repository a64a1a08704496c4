import sys

import pytest

from orchestrator.errors import ProcessFailed
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch
from protocol.messages import Role
from protocol.system.stop_request import StopRequest

SLEEP = "import time; time.sleep(600)"
NOTES_ITS_END = """
import pathlib, signal, sys, time
def end(*_):
    with open({file!r}, "a") as file:
        file.write({name!r} + "\\n")
    time.sleep(0.1)
    sys.exit(0)
signal.signal(signal.SIGTERM, end)
pathlib.Path({ready!r}).touch()
time.sleep(600)
"""


def test_nobody_is_left_behind_whatever_happens_inside(tmp_path, python_launch):
    fleet = Fleet(tmp_path, StopRequest())

    def fail_with_processes_running():
        with fleet:
            for name in ("render-0", "render-1"):
                fleet.start(python_launch(SLEEP, name))
            raise KeyError

    with pytest.raises(KeyError):
        fail_with_processes_running()
    assert [process.is_running for process in fleet.processes] == [False, False]


@pytest.mark.slow
def test_agents_end_before_the_workers_that_they_need(tmp_path, wait_until):
    order = tmp_path / "order"

    def launch(name: str, role: Role) -> Launch:
        code = NOTES_ITS_END.format(file=str(order), name=name, ready=str(tmp_path / f"{name}.ready"))
        address = None if role is Role.AGENT else f"ipc:///tmp/{name}"
        return Launch(name=name, role=role, address=address, command=(sys.executable, "-c", code))

    with Fleet(tmp_path, StopRequest()) as fleet:
        for name, role in (("worker", Role.RENDER), ("agent", Role.AGENT)):
            fleet.start(launch(name, role))
            wait_until((tmp_path / f"{name}.ready").exists)
    assert order.read_text().split() == ["agent", "worker"]


def test_who_does_not_listen_is_killed_at_once_when_asked_twice(tmp_path, worker_launch, wait_until):
    stop = StopRequest()
    with Fleet(tmp_path, stop) as fleet:
        process = fleet.start(worker_launch("ignores_sigterm"))
        wait_until(lambda: process.last_words() is not None)
        stop.ask()
        stop.ask()
    assert process.exit_code == -9


def test_every_start_is_noted(tmp_path, python_launch):
    noted = []
    with Fleet(tmp_path / "logs", StopRequest(), noted.append) as fleet:
        first = fleet.start(python_launch(SLEEP, "render-0", address="ipc:///tmp/a"))
        second = fleet.start(python_launch(SLEEP, "agent", Role.AGENT))
    assert [[record.name for record in records] for records in noted] == [["render-0"], ["render-0", "agent"]]
    assert [record.pid for record in noted[-1]] == [first.pid, second.pid]
    assert [record.address for record in noted[-1]] == ["ipc:///tmp/a", None]
    assert noted[-1][0].log == "logs/render-0.jsonl"


def test_a_process_is_started_again_in_its_place_only_after_its_end(tmp_path, python_launch):
    with Fleet(tmp_path, StopRequest()) as fleet:
        first = fleet.start(python_launch(SLEEP))
        with pytest.raises(ProcessFailed, match="runs already"):
            fleet.start(python_launch(SLEEP))
        first.kill()
        assert first.wait(30.0)
        second = fleet.start(python_launch(SLEEP))
        assert fleet.processes == (second,)
