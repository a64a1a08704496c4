import os

import psutil
import pytest

from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.orphans import Orphans
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.messages import Role

SLEEP = "import time; time.sleep(600)  # {}"


@pytest.fixture
def start(tmp_path, python_launch):
    """Starts a process of a name, whose command is its own; not all of it may be set up yet."""
    started = []

    def start(name: str, role: Role = Role.RENDER) -> WorkerProcess:
        launch = python_launch(SLEEP.format(tmp_path / name), name, role)
        process = WorkerProcess.start(launch, tmp_path / f"{name}.jsonl", {})
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait(30.0)


def record_of(process: WorkerProcess, started: float | None = None) -> ProcessRecord:
    return ProcessRecord(
        name=process.name,
        role=process.launch.role,
        address=None,
        pid=process.pid,
        started=process.started if started is None else started,
        log="logs/x.jsonl",
        log_start=17,
    )


def pids(found) -> list[int]:
    return [one.process.pid for one in found]


def test_a_process_that_was_written_down_is_taken_up_once(start):
    process = start("render-0")
    left = Orphans([record_of(process)], [process.launch], {"render-0"})
    found = left.take(process.launch)
    assert found is not None
    assert (found.process.pid, found.log_start) == (process.pid, 17)
    assert left.take(process.launch) is None
    assert left.unwanted == []


def test_a_process_that_was_never_written_down_is_found_by_its_command(start):
    process = start("agent", Role.AGENT)
    found = Orphans([], [process.launch], {"agent"}).take(process.launch)
    assert found is not None
    assert found.process.pid == process.pid


def test_an_orphan_of_an_unwanted_launch_is_to_be_ended(start):
    process = start("evaluation", Role.AGENT)
    left = Orphans([], [process.launch], {"agent"})
    assert left.take(process.launch) is None
    assert pids(left.unwanted) == [process.pid]


def test_of_two_with_one_command_the_one_that_was_written_down_is_kept(start):
    first, second = start("agent", Role.AGENT), start("agent", Role.AGENT)
    left = Orphans([record_of(second)], [first.launch], {"agent"})
    assert pids(left.unwanted) == [first.pid]
    found = left.take(first.launch)
    assert found is not None
    assert found.process.pid == second.pid


def test_an_orphan_with_another_command_is_to_be_ended(start, python_launch):
    process = start("render-0")
    other = python_launch("pass", "render-0")
    left = Orphans([record_of(process)], [other], {"render-0"})
    assert left.take(other) is None
    assert pids(left.unwanted) == [process.pid]


def test_a_process_that_has_the_number_of_one_that_ended_is_left_alone(start, python_launch):
    stranger = start("stranger")
    left = Orphans([record_of(stranger, started=1.0)], [python_launch("pass")], {"render-0"})
    assert left.unwanted == []


def test_a_process_that_has_ended_is_no_orphan(start):
    process = start("render-0")
    process.kill()
    assert process.wait(30.0)
    left = Orphans([record_of(process)], [process.launch], {"render-0"})
    assert left.take(process.launch) is None


def test_we_do_not_find_ourselves():
    ours = Launch(name="agent", role=Role.AGENT, command=tuple(psutil.Process().cmdline()))
    assert os.getpid() not in pids(Orphans([], [ours], set()).unwanted)
