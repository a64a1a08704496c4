import os
import signal

import psutil
import pytest

from orchestrator.errors import ProcessFailed
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.worker_process import LONGEST_QUOTE, WorkerProcess, ending
from protocol.client.client import Client
from protocol.messages import Role


def started(launch: Launch, folder, environment=None) -> WorkerProcess:
    return WorkerProcess.start(launch, folder / f"{launch.name}.jsonl", environment or {})


def test_what_a_process_writes_goes_to_its_log(tmp_path, python_launch):
    code = "import sys; print('out', flush=True); print('err', file=sys.stderr)"
    process = started(python_launch(code), tmp_path)
    assert process.wait(30.0)
    assert process.exit_code == 0
    assert process.log.read_text() == "out\nerr\n"


def test_a_process_gets_the_environment_of_the_run(tmp_path, python_launch):
    process = started(python_launch("import os; print(os.environ['X'], 'PATH' in os.environ)"), tmp_path, {"X": "1"})
    assert process.wait(30.0)
    assert process.log.read_text() == "1 True\n"


def test_an_exit_reason_names_the_process_its_end_its_last_error_and_its_log(tmp_path, worker_launch):
    process = started(worker_launch("dies_at_start"), tmp_path)
    assert process.wait(30.0)
    said = "bodies-v1.npz is missing; make it with 'orchestrator bodies bake'"
    assert process.exit_reason() == f"render-0 ended with exit code 2: {said} (log: {process.log})"


def test_an_error_counts_more_than_what_was_said_after_it(tmp_path, python_launch):
    code = """print('{"level": "error", "message": "no EGL"}'); print('{"level": "info", "message": "ended"}')"""
    process = started(python_launch(code), tmp_path)
    assert process.wait(30.0)
    assert process.last_words() == "no EGL"


def test_a_crash_is_quoted_by_its_last_line(tmp_path, python_launch):
    process = started(python_launch("raise RuntimeError('no such luck')"), tmp_path)
    assert process.wait(30.0)
    assert process.last_words() == "RuntimeError: no such luck"


def test_the_exit_reason_of_a_killed_process_quotes_no_log_line(tmp_path, python_launch, wait_until):
    process = started(python_launch("import time; print('all is well', flush=True); time.sleep(600)"), tmp_path)
    wait_until(lambda: process.last_words() is not None)
    process.kill()
    assert process.wait(30.0)
    assert process.exit_reason() == f"render-0 was killed by SIGKILL (log: {process.log})"


def test_long_last_words_are_cut(tmp_path, python_launch):
    process = started(python_launch("print('x' * 10_000)"), tmp_path)
    assert process.wait(30.0)
    assert process.last_words() == "x" * LONGEST_QUOTE + "…"


def test_the_words_of_an_earlier_process_are_not_taken_for_this_ones(tmp_path, python_launch):
    assert started(python_launch("print('earlier')"), tmp_path).wait(30.0)
    process = started(python_launch("pass"), tmp_path)
    assert process.wait(30.0)
    assert process.last_words() is None
    assert "without a word" in process.exit_reason()
    assert process.log.read_text() == "earlier\n"


@pytest.mark.slow
def test_a_stopped_process_can_be_asked_to_stop(tmp_path, worker_launch, wait_until):
    process = started(worker_launch("serves_nothing"), tmp_path)
    with Client(str(process.launch.address), role=Role.ORCHESTRATOR) as client:
        client.wait_ready()
    os.kill(process.pid, signal.SIGSTOP)
    wait_until(lambda: process.is_stopped)
    process.ask_to_stop()
    assert process.wait(30.0)
    assert process.exit_code == 0


def test_a_killed_process_takes_its_own_children_with_it(tmp_path, worker_launch, wait_until):
    process = started(worker_launch("ignores_sigterm"), tmp_path)
    wait_until(lambda: process.log.read_text().endswith("\n"))
    child = psutil.Process(int(process.log.read_text()))
    process.ask_to_stop()
    assert not process.wait(0.2)
    process.kill()
    assert process.wait(30.0)
    wait_until(lambda: not child.is_running() or child.status() == psutil.STATUS_ZOMBIE)
    assert process.exit_code == -signal.SIGKILL


def test_a_command_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ProcessFailed, match="render-0 can't be started"):
        started(Launch(name="render-0", role=Role.RENDER, command=("/no/such/program",)), tmp_path)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (None, "is running"),
        (0, "ended with exit code 0"),
        (2, "ended with exit code 2"),
        (-9, "was killed by SIGKILL"),
        (-11, "was killed by SIGSEGV"),
        (-99, "was killed by signal 99"),
    ],
)
def test_an_end_is_told_in_words(code, words):
    assert ending(code) == words
