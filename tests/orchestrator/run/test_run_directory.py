import os
import stat

import msgspec
import pytest

from orchestrator.errors import NoSuchRun, RunBusy, RunError, RunExists
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.restart import Restart
from orchestrator.run.run_directory import Plan, RunDirectory
from protocol.artifact import sha256
from protocol.config import RunConfig
from protocol.errors import InvalidConfig
from protocol.messages import Role
from protocol.records import Evaluation, Phase, Progress, Summary


def progress(step: int, phase: Phase = "training") -> bytes:
    record = Progress(time=0.0, phase=phase, step=step, steps=10, episodes=0, steps_per_second=1.0)
    return msgspec.json.encode(record)


def test_a_new_run_has_its_configuration_its_versions_and_a_place_for_logs(run):
    assert sorted(path.name for path in run.path.iterdir()) == ["config.toml", "logs", "plan.json", "versions.json"]
    assert msgspec.json.decode((run.path / "versions.json").read_bytes())["environment"] == {"OMP_NUM_THREADS": "1"}


def test_an_existing_run_is_refused_and_stays_as_it_was(run, versions):
    before = sorted(run.path.rglob("*")), run.config_path.read_bytes()
    with pytest.raises(RunExists, match="never overwritten"):
        RunDirectory.create(run.path, RunConfig(seed=7), versions)
    assert (sorted(run.path.rglob("*")), run.config_path.read_bytes()) == before


def test_a_run_that_cant_be_made_leaves_nothing_behind(tmp_path, versions):
    (tmp_path / "taken").write_text("a file, not a directory")
    with pytest.raises(RunError, match="can't be made"):
        RunDirectory.create(tmp_path / "taken" / "run", RunConfig(), versions)
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_others_may_read_a_run_as_far_as_the_user_lets_them(run):
    assert stat.S_IMODE(run.path.stat().st_mode) == 0o755


def test_a_directory_without_a_configuration_is_no_run(tmp_path):
    with pytest.raises(NoSuchRun, match="has no config"):
        RunDirectory.open(tmp_path)


def test_a_damaged_configuration_of_a_run_is_named(run):
    run.config_path.write_text(run.config_path.read_text().replace("prefill_noise", "prefill_nois"))
    with pytest.raises(InvalidConfig, match=r"config\.toml is damaged: it lacks training\.prefill_noise"):
        run.config()


def test_progress_is_the_last_whole_line(run):
    run.progress_path.write_bytes(progress(1) + b"\n" + progress(2) + b"\n" + progress(3)[:20])
    found = run.progress()
    assert found is not None
    assert found.step == 2


def test_a_run_whose_agent_has_said_nothing_has_no_progress_no_summary_and_no_evaluation(run):
    assert (run.progress(), run.summary(), run.evaluation(), run.processes()) == (None, None, None, ())


def test_processes_read_back_as_they_were_written(run):
    record = ProcessRecord(
        name="render-0", role=Role.RENDER, address="ipc:///tmp/x", pid=12, started=3.5, log="logs/render-0.jsonl"
    )
    run.write_processes([record])
    assert run.processes() == (record,)


def test_restarts_read_back_in_their_order_and_one_that_is_being_written_is_passed_over(run):
    restarts = [Restart(time=float(number), process="agent", reason="it ended") for number in range(3)]
    for restart in restarts:
        run.note_restart(restart)
    with run.restarts_path.open("ab") as file:
        file.write(b'{"time": 3.0, "pro')
    assert run.restarts() == tuple(restarts)


def summary(*, complete: bool) -> bytes:
    return msgspec.json.encode(
        Summary(
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
    )


def test_a_training_is_over_only_when_all_its_steps_are_flown(run):
    assert not run.is_trained()
    run.summary_path.write_bytes(summary(complete=False))
    assert not run.is_trained()
    run.summary_path.write_bytes(summary(complete=True))
    assert run.is_trained()


def evaluation(**what: str) -> bytes:
    return msgspec.json.encode(Evaluation(first_seed=1, success_threshold=1.6, scores=(), **what))


def test_an_evaluation_counts_for_the_weights_that_it_flew_whenever_files_were_written(run):
    run.weights_path.write_bytes(b"weights")
    run.evaluation_path.write_bytes(evaluation(weights=sha256(run.weights_path), by="an agent"))
    for written in (0.0, 4e9):
        os.utime(run.evaluation_path, (written, written))
        assert run.is_evaluated()
    run.weights_path.write_bytes(b"weights that were trained for longer")
    assert not run.is_evaluated()


@pytest.mark.parametrize(("phase", "counts"), [("evaluation", True), ("done", False), ("training", False)])
def test_an_evaluation_that_names_no_weights_counts_if_an_agent_flew_one_last(run, phase, counts):
    run.evaluation_path.write_bytes(evaluation())
    run.progress_path.write_bytes(progress(1, phase) + b"\n")
    assert run.is_evaluated() == counts


def test_an_evaluation_of_a_version_that_knew_no_metres_is_read(run):
    old = Evaluation(first_seed=1, success_threshold=1.6, scores=(), weights="0" * 64, by="one")
    record = msgspec.to_builtins(old)
    del record["in_metres"]
    run.evaluation_path.write_bytes(msgspec.json.encode(record))
    assert run.evaluation() == old


def test_an_evaluation_that_was_there_before_is_not_taken_for_a_new_one(run):
    assert not run.is_evaluated_since(None)
    run.evaluation_path.write_bytes(evaluation(by="an agent"))
    before = run.evaluation()
    assert run.is_evaluated_since(None)
    assert not run.is_evaluated_since(before)
    run.evaluation_path.write_bytes(evaluation(by="another"))
    assert run.is_evaluated_since(before)


def test_a_run_is_finished_when_all_that_was_planned_is_done(tmp_path, versions):
    with_evaluation = RunDirectory.create(tmp_path / "a", RunConfig(), versions, Plan(evaluate=True))
    without = RunDirectory.create(tmp_path / "b", RunConfig(), versions, Plan(evaluate=False))
    for run in (with_evaluation, without):
        run.summary_path.write_bytes(summary(complete=True))
    assert (with_evaluation.is_finished(), without.is_finished()) == (False, True)


def test_only_one_orchestrator_works_on_a_run(run):
    with run.lock():
        assert run.is_busy()
        with pytest.raises(RunBusy, match="another orchestrator"), run.lock(patience=0.0):
            pass
    assert not run.is_busy()
    with run.lock(patience=0.0):
        pass
