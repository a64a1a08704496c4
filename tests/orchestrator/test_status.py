from io import StringIO

import msgspec
import psutil
import pytest
from rich.console import Console

from orchestrator.restart import Restart
from orchestrator.run_directory import Plan, ProcessRecord
from orchestrator.status import run_status, status_view
from orchestrator.worker_process import WorkerProcess
from protocol.records import Progress, Summary


def record_of(process: WorkerProcess) -> ProcessRecord:
    launch = process.launch
    return ProcessRecord(
        name=launch.name,
        role=launch.role,
        address=launch.address,
        pid=process.pid,
        started=process.started,
        log=f"logs/{launch.name}.jsonl",
    )


@pytest.fixture
def worker(tmp_path, worker_launch):
    process = WorkerProcess.start(worker_launch("serves_nothing"), tmp_path / "log.jsonl", {})
    yield process
    process.kill()
    process.wait(30.0)


def text_of(status) -> str:
    console = Console(width=120, record=True, file=StringIO())
    console.print(status_view(status))
    return console.export_text()


def test_a_run_that_goes_on_tells_its_phase_and_its_workers_own_words(run, worker, wait_until):
    progress = Progress(time=1.0, phase="prefill", step=5, steps=9, episodes=0, steps_per_second=2.5)
    run.progress_path.write_bytes(msgspec.json.encode(progress) + b"\n")
    run.write_processes([record_of(worker)])
    with run.lock():
        wait_until(lambda: run_status(run, patience=1.0).workers[0].state == "ready")
        status = run_status(run, patience=10.0)
    assert (status.state, status.phase, status.progress) == ("running", "prefill", progress)
    assert not status.has_weights
    text = text_of(status)
    assert "prefill 5/9" in text
    assert "render-0" in text


def test_a_dead_run_is_not_running_and_keeps_its_last_word(run, worker):
    run.progress_path.write_bytes(
        msgspec.json.encode(Progress(time=1.0, phase="done", step=9, steps=9, episodes=2, steps_per_second=2.5)) + b"\n"
    )
    run.write_processes([record_of(worker)])
    run.weights_path.touch()
    worker.kill()
    assert worker.wait(30.0)
    status = run_status(run)
    assert (status.state, status.phase, status.workers[0].state) == ("not running", "done", "not running")
    assert status.has_weights
    assert "not running" in text_of(status).splitlines()[0]


@pytest.mark.slow
def test_a_run_whose_orchestrator_was_killed_is_abandoned(run, worker, wait_until):
    run.write_processes([record_of(worker)])
    wait_until(lambda: run_status(run, patience=1.0).workers[0].state == "ready")
    status = run_status(run, patience=10.0)
    assert status.state == "abandoned"
    assert "its orchestrator is gone" in text_of(status)
    assert "'orchestrator resume" in text_of(status)


def test_restarts_are_counted_and_replacements_are_not(run, worker):
    run.write_processes([record_of(worker)])
    for planned in (False, True, False):
        run.note_restart(Restart(time=1.0, process="render-0", reason="hung", planned=planned))
    status = run_status(run, patience=0.0)
    assert (status.restarts, status.workers[0].restarts) == ({"render-0": 2}, 2)


def test_a_run_that_was_stopped_is_to_be_resumed_and_a_finished_one_is_not(run):
    def status_after(*, complete: bool) -> str:
        summary = Summary(
            steps=1,
            episodes=1,
            updates=1,
            seconds=1.0,
            steps_per_second=1.0,
            stages={},
            late_replies=0,
            retries=0,
            complete=complete,
        )
        run.summary_path.write_bytes(msgspec.json.encode(summary))
        return text_of(run_status(run))

    (run.path / "plan.json").write_bytes(msgspec.json.encode(Plan(evaluate=False)))
    assert "it has not come to its end" in status_after(complete=False)
    assert "it has not come to its end" not in status_after(complete=True)


def test_a_run_that_never_began_says_so(run):
    status = run_status(run)
    assert (status.state, status.phase, status.workers) == ("not running", None, ())
    assert "has not said anything" in text_of(status)


def test_looking_leaves_no_thread_and_no_file(run, worker, wait_until):
    run.write_processes([record_of(worker)])
    wait_until(lambda: run_status(run, patience=1.0).workers[0].state == "ready")
    files, threads = sorted(run.path.rglob("*")), thread_ids()
    run_status(run)
    # Which, not how many: a thread of an earlier look may still be ending.
    wait_until(lambda: thread_ids() <= threads)
    assert sorted(run.path.rglob("*")) == files


def thread_ids() -> set[int]:
    return {thread.id for thread in psutil.Process().threads()}
