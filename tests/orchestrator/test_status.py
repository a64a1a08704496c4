from io import StringIO

import msgspec
import psutil
import pytest
from rich.console import Console

from orchestrator.errors import Interrupted, ProcessFailed
from orchestrator.restart import Restart
from orchestrator.run_directory import Plan, ProcessRecord
from orchestrator.status import moment, run_status, status_view
from orchestrator.work_record import noted_work
from orchestrator.worker_process import WorkerProcess
from protocol.messages import Role
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


class TestAfterwards:
    """Of a run that nobody works on any more."""

    @pytest.fixture(autouse=True)
    def _left_in_the_middle(self, run):
        progress = Progress(time=1e9, phase="training", step=404, steps=1600, episodes=3, steps_per_second=10.4)
        run.progress_path.write_bytes(msgspec.json.encode(progress) + b"\n")
        run.write_processes([ProcessRecord(name="a", role=Role.AGENT, address=None, pid=1, started=0.0, log="logs/a")])

    def test_one_that_came_to_its_end_says_when_with_what_and_where(self, run):
        summary = Summary(
            steps=1600,
            episodes=16,
            updates=9,
            seconds=83.0,
            steps_per_second=19.0,
            stages={},
            late_replies=0,
            retries=0,
        )
        half = Interval(0.5, 0.4, 0.6)
        score = PolicyScore(
            policy="sac", episodes=16, total_reward=half, uncertainty=half, success=half, crash=half, length=half
        )
        with noted_work(run.work_path, "train", wall_clock=lambda: 1e9):
            run.weights_path.touch()
            run.summary_path.write_bytes(msgspec.json.encode(summary))
            evaluation = Evaluation(first_seed=1, success_threshold=1.6, scores=(score,))
            run.evaluation_path.write_bytes(msgspec.json.encode(evaluation))
        with pytest.raises(ProcessFailed), noted_work(run.work_path, "evaluate", wall_clock=lambda: 2e9):
            raise ProcessFailed("render-0 died")
        status = run_status(run)
        assert (status.state, status.ended, status.reason) == ("finished", 1e9, "")
        text = text_of(status)
        assert "404" not in text
        assert "not running" not in text
        assert f"it has come to its end on {moment(1e9)}" in text
        assert "trained 1600 steps in 1:23" in text
        assert "policy 'sac' over 16 flights: return 0.5, uncertainty 0.50, success 50%, crash 50%" in text
        assert "weights.safetensors, evaluation.json, logs in" in text
        assert "'orchestrator evaluate" in text

    @pytest.mark.parametrize(
        ("error", "state"),
        [(Interrupted("training was stopped on request"), "stopped"), (ProcessFailed("render-0 died"), "failed")],
    )
    def test_one_that_did_not_says_how_far_it_came_why_it_ended_and_how_to_go_on(self, run, error, state):
        with pytest.raises(type(error)), noted_work(run.work_path, "train"):
            raise error
        status = run_status(run)
        assert (status.state, status.reason) == (state, str(error))
        text = text_of(status)
        assert str(error) in text
        assert "it came to step 404 of 1600 in its training" in text
        assert "go on with it by 'orchestrator resume" in text
        assert "10.4 steps/s" not in text

    def test_one_whose_orchestrator_was_killed_says_so(self, run):
        with noted_work(run.work_path, "train"):
            written = run.work_path.read_bytes()
        run.work_path.write_bytes(written)
        status = run_status(run)
        assert status.state == "killed"
        assert "its orchestrator was killed" in text_of(status)

    def test_going_on_with_it_is_what_counts(self, run):
        with pytest.raises(ProcessFailed), noted_work(run.work_path, "train"):
            raise ProcessFailed("render-0 died")
        with pytest.raises(Interrupted), noted_work(run.work_path, "resume"):
            raise Interrupted("stopped on request")
        assert run_status(run).state == "stopped"

    def test_one_of_a_time_that_no_calendar_has_is_shown_all_the_same(self, run):
        progress = Progress(time=1e300, phase="training", step=404, steps=1600, episodes=3, steps_per_second=10.4)
        run.progress_path.write_bytes(msgspec.json.encode(progress) + b"\n")
        assert "1e+300 s after 1970" in text_of(run_status(run))
