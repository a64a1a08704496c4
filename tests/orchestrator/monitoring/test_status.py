from io import StringIO

import msgspec
import psutil
import pytest
from rich.console import Console

from orchestrator.monitoring.status import moment, run_status, status_view
from orchestrator.run.ending import Ending
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.restart import Restart
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.artifact import sha256
from protocol.records import Evaluation, Interval, PolicyScore, Progress, Summary


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


def test_a_run_whose_processes_were_killed_is_broken_off_and_keeps_its_last_word(run, worker):
    run.progress_path.write_bytes(
        msgspec.json.encode(Progress(time=1.0, phase="done", step=9, steps=9, episodes=2, steps_per_second=2.5)) + b"\n"
    )
    run.write_processes([record_of(worker)])
    run.weights_path.touch()
    worker.kill()
    assert worker.wait(30.0)
    status = run_status(run)
    assert (status.state, status.phase, status.workers[0].state) == ("broken off", "done", "not running")
    assert status.has_weights
    assert "broken off" in text_of(status).splitlines()[0]


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


SUMMARY = Summary(
    steps=1600,
    episodes=40,
    updates=1,
    seconds=192.0,
    steps_per_second=8.3,
    stages={},
    late_replies=0,
    retries=0,
)


@pytest.fixture
def finished(run, worker):
    """A run that was trained and evaluated, its processes ended, and the last progress said in mid-evaluation."""
    run.weights_path.write_bytes(b"weights")
    run.summary_path.write_bytes(msgspec.json.encode(SUMMARY))
    figure = Interval(0.5, 0.25, 0.75)
    score = PolicyScore(
        policy="sac",
        episodes=5,
        total_reward=figure,
        uncertainty=figure,
        success=figure,
        crash=figure,
        length=figure,
    )
    evaluation = Evaluation(
        first_seed=1, success_threshold=1.6, scores=(score,), weights=sha256(run.weights_path), by="an agent"
    )
    run.evaluation_path.write_bytes(msgspec.json.encode(evaluation))
    said = Progress(time=7.0, phase="evaluation", step=1404, steps=1600, episodes=0, steps_per_second=10.4)
    run.progress_path.write_bytes(msgspec.json.encode(said) + b"\n")
    run.write_processes([record_of(worker)])
    worker.kill()
    assert worker.wait(30.0)
    return run


def test_a_finished_run_tells_what_it_came_to_and_no_progress_as_if_it_were_now(finished):
    finished.end(Ending(time=1e9, outcome="finished"))
    status = run_status(finished)
    assert (status.state, status.ended, status.is_finished) == ("finished", 1e9, True)
    text = text_of(status)
    assert f"the run finished on {moment(1e9)}" in text
    assert "trained 1600 steps in 3:12" in text
    assert "policy 'sac' over 5 flights: return 0.5, uncertainty 0.5, success 50%, crash 50%" in text
    assert f"weights.safetensors, evaluation.json, logs in {finished.path.resolve()}" in text.replace("\n", "")
    assert f"'orchestrator evaluate {finished.path}'" in text.replace("\n", "")
    for stale in ("1404", "steps/s   ", "not running", "go on with it"):
        assert stale not in text


def test_a_finished_run_of_before_endings_were_written_down_ended_about_when_its_agent_spoke_last(finished):
    status = run_status(finished)
    assert (status.state, status.ended) == ("finished", 7.0)


@pytest.mark.parametrize("outcome", ["stopped", "failed"])
def test_a_run_that_ended_early_tells_how_far_it_came_why_and_how_to_go_on(finished, outcome):
    finished.summary_path.unlink()
    finished.end(Ending(time=1e9, outcome=outcome, reason="agent ended with exit code 2: no more room"))
    status = run_status(finished)
    assert (status.state, status.is_finished) == (outcome, False)
    text = text_of(status)
    assert "agent ended with exit code 2: no more room" in text
    assert f"on {moment(1e9)}" in text
    assert "it reached step 1404 of 1600 of its evaluation" in text
    assert "10.4 steps/s" not in text
    assert f"'orchestrator resume {finished.path}'" in text.replace("\n", "")


def test_a_run_that_was_stopped_and_is_evaluated_later_ended_with_that(finished):
    finished.end(Ending(time=6.0, outcome="stopped", reason="somebody asked"))
    status = run_status(finished)
    assert (status.state, status.ended, status.reason) == ("finished", 7.0, None)


def test_a_run_that_is_taken_up_again_has_not_ended(finished):
    finished.end(Ending(time=1e9, outcome="stopped", reason="somebody asked"))
    finished.begin()
    assert run_status(finished).ended == 7.0


def test_a_run_whose_orchestrator_was_killed_when_it_went_on_is_broken_off(finished):
    finished.summary_path.unlink()
    finished.end(Ending(time=1e9, outcome="failed", reason="render-0 died"))
    finished.begin()
    status = run_status(finished)
    assert (status.state, status.ended, status.reason) == ("broken off", 7.0, None)
    text = text_of(status)
    assert "its orchestrator was killed" in text
    assert f"last heard of on {moment(7.0)}" in text
    assert f"the run is not finished: continue it by 'orchestrator resume {finished.path}'" in text.replace("\n", "")


def test_a_run_of_a_time_that_no_calendar_has_is_shown_all_the_same(run):
    said = Progress(time=1e300, phase="training", step=404, steps=1600, episodes=3, steps_per_second=10.4)
    run.progress_path.write_bytes(msgspec.json.encode(said) + b"\n")
    assert "1e+300 s after 1970" in text_of(run_status(run)).replace("\n", "")


@pytest.mark.parametrize("name", ["config.toml", "plan.json", "versions.json"])
def test_a_damaged_run_says_what_is_damaged(finished, name):
    (finished.path / name).write_bytes(b"")
    status = run_status(finished)
    assert status.state == "damaged"
    assert name in str(status.reason)


def test_a_run_that_never_began_says_so(run):
    status = run_status(run)
    assert (status.state, status.phase, status.workers) == ("broken off", None, ())
    assert "no work on it has begun" in text_of(status)
    assert "has not reported any progress" in text_of(status)


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
