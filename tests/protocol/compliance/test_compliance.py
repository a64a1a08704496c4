"""The compliance suite passes workers that keep to the protocol, and names the rule that another one breaks."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.protocol.compliance.suite import judge

WORKERS = Path(__file__).parent / "workers"
ROOT = Path(__file__).parents[3]
PATIENCE = 30.0

BROKEN = {
    "accepts_any_version": {
        "test_a_hello_without_a_common_version_is_refused",
        "test_a_hello_is_read_in_any_version",
        "test_the_version_agreed_on_is_one_that_was_offered",
    },
    "answers_pings_from_its_handler": {"test_pings_are_answered_while_work_is_computed"},
    "dies_of_garbage": {"test_a_message_that_can_t_be_told_apart_is_refused_or_passed_over"},
    "draws_what_can_t_be": {"test_a_number_that_can_t_be_is_refused_by_name"},
    "draws_parts_by_themselves": {"test_a_part_of_a_picture_is_what_the_whole_picture_shows_there"},
    "forgets_the_upper_half_of_request_ids": {"test_any_id_comes_back_as_it_was"},
    "ignores_deadlines": {
        "test_a_request_whose_deadline_has_passed_is_refused",
        "test_a_deadline_that_passes_in_the_queue_is_told",
    },
    "is_another_in_every_pong": {"test_every_reply_names_the_same_incarnation", "test_it_is_still_the_same_process"},
    "is_silent_about_what_others_do": {"test_a_request_of_another_role_is_unsupported"},
    "takes_any_value_for_its_own_mistake": {
        "test_a_number_that_can_t_be_is_refused_by_name",
        "test_any_number_brings_an_answer_or_a_refusal",
        "test_a_region_that_is_not_in_the_picture_is_refused_or_passed_over",
    },
    "takes_any_number": {"test_more_requests_than_a_worker_takes_are_refused_at_once"},
    "takes_work_while_draining": {"test_drain_finishes_what_is_in_hand_and_takes_no_more"},
}
"""What each of `workers/` does wrong, and the rules that say so."""


@contextmanager
def running(*command: str | Path, at: str) -> Iterator[subprocess.Popen[bytes]]:
    """A worker's process that has bound its address."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    process = subprocess.Popen([sys.executable, *command], env=environment, stderr=subprocess.DEVNULL)
    try:
        end = time.monotonic() + PATIENCE
        while not Path(at.removeprefix("ipc://")).is_socket():
            assert process.poll() is None, "the worker has ended"
            assert time.monotonic() < end, "the worker does not serve"
            time.sleep(0.02)
        yield process
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def folder() -> Iterator[Path]:
    """With a path short enough for a socket on every system."""
    with tempfile.TemporaryDirectory(prefix="v") as directory:
        yield Path(directory)


@pytest.fixture
def address(folder: Path) -> str:
    return f"ipc://{folder}/worker"


@pytest.mark.slow
def test_a_worker_without_our_server_passes(address, folder):
    with running(WORKERS / "proper_worker.py", address, at=address) as process:
        verdict = judge("--worker", address, "--drain", folder=folder)
        assert (verdict.code, verdict.failed) == (0, set()), verdict.output
        assert process.wait(PATIENCE) == 0


@pytest.mark.slow
def test_both_rooms_workers_pass(folder):
    render, perception = f"ipc://{folder}/render", f"ipc://{folder}/perception"
    with (
        running("-m", "render_worker", "--bind", render, at=render) as renderer,
        running("-m", "perception_worker", "--bind", perception, "--render", render, at=perception) as perceiver,
    ):
        for address, process in ((perception, perceiver), (render, renderer)):
            verdict = judge("--worker", address, "--patience", "30", "--drain", folder=folder)
            assert (verdict.code, verdict.failed) == (0, set()), verdict.output
            assert process.wait(PATIENCE) == 0


@pytest.mark.slow
@pytest.mark.parametrize("sin", BROKEN)
def test_a_broken_worker_fails_the_rule_that_it_breaks_and_no_other(sin, address, folder):
    with running(WORKERS / f"{sin}.py", address, at=address):
        verdict = judge("--worker", address, "--patience", "5", "--drain", folder=folder)
    assert (verdict.code, verdict.failed) == (1, BROKEN[sin]), verdict.output
    assert len(verdict.passed) > 10
    assert ("the worker answers no more after" in verdict.output) == (sin == "dies_of_garbage")


@pytest.mark.slow
def test_a_worker_that_forgets_the_request_id_fails_where_requests_are_under_way_at_once(address, folder):
    with running(WORKERS / "forgets_the_request_id.py", address, at=address):
        verdict = judge("--worker", address, "--patience", "5", "-k", "replies", folder=folder)
    assert "test_each_reply_has_its_request_s_id" in verdict.failed, verdict.output
    assert "test_work_is_answered_by_what_was_asked_for" in verdict.passed, verdict.output


@pytest.mark.slow
def test_a_failed_rule_says_what_it_is_and_why(address, folder):
    with running(WORKERS / "accepts_any_version.py", address, at=address):
        verdict = judge("--worker", address, "-k", "without_a_common_version", folder=folder)
    assert "is answered by `version-mismatch`, not retryable" in verdict.output
    assert "Silence would keep the client waiting" in verdict.output


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ([], "name its address: --worker tcp://host:port"),
        (["--worker", "localhost:5555"], "'localhost:5555' is not an address; write tcp://host:port or ipc://"),
        (["--worker", "ipc:///tmp/x", "--patience", "soon"], "'soon' is not a number of seconds above 0"),
        (
            ["--worker", "ipc:///tmp/nobody", "--patience", "0.1"],
            "no worker to test at ipc:///tmp/nobody: waited 0.1 s",
        ),
        (["--worker", "ipc:///tmp/x", "-n", "2"], "run it without -n"),
    ],
    ids=["no worker", "no address", "no number", "nobody there", "several at once"],
)
def test_a_wrong_command_is_told_in_a_line(options, complaint, folder):
    verdict = judge(*options, folder=folder)
    assert verdict.code == pytest.ExitCode.USAGE_ERROR
    assert complaint in verdict.output
    assert "Traceback" not in verdict.output
