"""`status` of processes by their HTTP endpoints."""

import json

from protocol.messages import Role
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint
from tests.serving import serving


def test_who_is_ready_is_told_and_ends_with_0(invoke, tmp_path):
    at = free_endpoint()
    about = About(role=Role.RENDER, name="render-7")
    with (
        worker_telemetry(at, about) as observer,
        serving({}, f"ipc://{tmp_path}/r", role=Role.RENDER, observer=observer),
    ):
        wait_until(lambda: invoke("status", "--http", str(at)).exit_code == 0)
        told = json.loads(invoke("status", "--http", str(at), "--json").stdout)
    assert [(one["at"], one["ready"], one["info"]["name"]) for one in told] == [(str(at), True, "render-7")]


def test_a_process_that_does_not_answer_is_reported_and_ends_with_1(invoke):
    done = invoke("status", "--http", str(free_endpoint()))
    assert done.exit_code == 1
    assert "no answer" in done.stdout


def test_a_run_and_processes_at_once_are_a_mistake(invoke):
    assert invoke("status", "runs/x", "--http", "8000").exit_code == 2
