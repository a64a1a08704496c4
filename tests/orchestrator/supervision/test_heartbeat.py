import os
import signal

import psutil
import pytest

from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.heartbeat import Heartbeat, is_alive
from orchestrator.supervision.worker_process import WorkerProcess
from protocol import Pool
from protocol.errors import WrongRole
from protocol.messages import Role
from protocol.timeouts import Timeouts
from tests.serving import serving

FAST = Timeouts(heartbeat=0.1)


@pytest.fixture
def start(tmp_path, worker_launch):
    """Starts one of the programs in `workers/`, and says what `workers.json` would."""
    started = []

    def start(program: str, role: Role = Role.RENDER) -> ProcessRecord:
        process = WorkerProcess.start(worker_launch(program), tmp_path / "log.jsonl", {})
        started.append(process)
        return ProcessRecord(
            name="render-0",
            role=role,
            address=process.launch.address,
            pid=process.pid,
            started=process.started,
            log="logs/render-0.jsonl",
        )

    yield start
    for process in started:
        process.kill()
        process.wait(30.0)


def test_a_worker_that_works_is_ready(start, wait_until):
    with Heartbeat(start("serves_nothing"), FAST) as heartbeat:
        wait_until(lambda: heartbeat.beat().state == "ready")
        assert heartbeat.is_ready
        health = heartbeat.beat()
        assert (health.name, health.answered, health.queue_depth) == ("render-0", 0, 0)
        assert health.resident_bytes > 2**20


def test_a_worker_that_loads_is_starting_and_not_ready(start, wait_until):
    with Heartbeat(start("never_gets_ready"), FAST) as heartbeat:
        wait_until(lambda: heartbeat.beat().state == "starting")
        assert not heartbeat.is_ready


def test_a_worker_whose_own_workers_are_gone_waits_and_has_got_ready_all_the_same(tmp_path, wait_until):
    address = f"ipc://{tmp_path}/perception"
    this = psutil.Process()
    record = ProcessRecord(
        name="perception-0",
        role=Role.PERCEPTION,
        address=address,
        pid=this.pid,
        started=this.create_time(),
        log="logs/perception-0.jsonl",
    )
    with (
        Pool([], role=Role.PERCEPTION, serves=Role.RENDER) as nobody,
        serving({}, address, role=Role.PERCEPTION, calls={Role.RENDER: nobody}),
        Heartbeat(record, FAST) as heartbeat,
    ):
        wait_until(lambda: heartbeat.beat().state == "waiting")
        assert heartbeat.is_ready


@pytest.mark.slow
def test_a_stopped_worker_becomes_silent_and_wakes_up_again(start, wait_until):
    record = start("serves_nothing")
    with Heartbeat(record, FAST) as heartbeat:
        wait_until(lambda: heartbeat.beat().state == "ready")
        os.kill(record.pid, signal.SIGSTOP)
        wait_until(lambda: heartbeat.beat().state == "silent")
        os.kill(record.pid, signal.SIGCONT)
        wait_until(lambda: heartbeat.beat().state == "ready")


@pytest.mark.slow
def test_a_killed_worker_is_not_running(start, wait_until):
    record = start("serves_nothing")
    with Heartbeat(record, FAST) as heartbeat:
        wait_until(lambda: heartbeat.beat().state == "ready")
        os.kill(record.pid, signal.SIGKILL)
        wait_until(lambda: heartbeat.beat().state == "not running")


@pytest.mark.slow
def test_a_worker_of_another_role_is_refused(start, wait_until):
    with Heartbeat(start("serves_nothing", Role.PERCEPTION), FAST) as heartbeat:

        def refused() -> bool:
            heartbeat.beat()
            try:
                heartbeat.check()
            except WrongRole:
                return True
            return False

        wait_until(refused)


def test_a_process_of_the_same_number_is_not_taken_for_the_one_that_was_recorded():
    us = psutil.Process()
    record = ProcessRecord(
        name="agent", role=Role.AGENT, address=None, pid=us.pid, started=us.create_time(), log="logs/agent.jsonl"
    )
    assert is_alive(record)
    earlier = ProcessRecord(
        name="agent", role=Role.AGENT, address=None, pid=us.pid, started=us.create_time() - 5, log="logs/agent.jsonl"
    )
    assert not is_alive(earlier)


def test_an_agent_serves_nothing_and_is_running():
    us = psutil.Process()
    record = ProcessRecord(
        name="agent", role=Role.AGENT, address=None, pid=us.pid, started=us.create_time(), log="logs/agent.jsonl"
    )
    with Heartbeat(record, FAST) as heartbeat:
        assert heartbeat.beat().state == "running"
