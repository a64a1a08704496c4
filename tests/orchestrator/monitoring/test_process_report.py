"""Asks processes behind real HTTP ports for their state, and reports those that give no answer."""

import http.server
import socket
import threading
from contextlib import contextmanager

import pytest
from rich.console import Console

from orchestrator.monitoring.process_report import process_reports, reports_table
from protocol import Pool
from protocol.messages import Role
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.processes.serving import serving
from tests.protocol.telemetry.monitors import free_endpoint


@pytest.fixture
def address(tmp_path) -> str:
    return f"ipc://{tmp_path}/worker"


def shown(reports) -> str:
    console = Console(width=400)
    with console.capture() as capture:
        console.print(reports_table(reports))
    return " ".join(capture.get().split())


@contextmanager
def somebody_else():
    """A web server that knows nothing of us."""

    class Elsewhere(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"<html>hello</html>")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Elsewhere)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield Endpoint("127.0.0.1", server.server_port)
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_a_worker_at_work_is_ready_and_tells_its_figures(address):
    at = free_endpoint()
    with (
        worker_telemetry(at, About(role=Role.RENDER, name="render-7")) as observer,
        serving(address, observer=observer),
        client_of(address) as client,
    ):
        client.call(ask(1))
        (report,) = process_reports([at])
    assert (report.trouble, report.ready, report.waits_for) == ("", True, ())
    assert (report.info.role, report.info.name) == (Role.RENDER, "render-7")
    assert report.figures["requests"] == 1
    assert f"{at} render render-7 ready requests 1, in flight 0" in shown([report])


def test_a_parent_says_whom_it_waits_for(address):
    at = free_endpoint()
    with (
        Pool([f"{address}-child"], role=Role.PERCEPTION, serves=Role.RENDER) as children,
        worker_telemetry(at, About(role=Role.PERCEPTION, name="jetson"), {Role.RENDER: children}) as observer,
        serving(address, role=Role.PERCEPTION, observer=observer),
    ):
        (report,) = process_reports([at])
    assert not report.ready
    assert [wait.on for wait in report.waits_for] == ["render"]
    assert "waits for render (" in shown([report])


def test_where_nobody_is_or_somebody_else_that_is_said_in_the_order_of_the_places():
    nobody = free_endpoint()
    with somebody_else() as elsewhere:
        reports = process_reports([nobody, elsewhere])
    assert [report.at for report in reports] == [str(nobody), str(elsewhere)]
    assert reports[0].trouble.startswith("no answer: ")
    assert reports[1].trouble.startswith("this is not a Vantage process: ")
    assert not any(report.ready for report in reports)


def test_who_says_nothing_is_given_up():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        (report,) = process_reports([Endpoint("127.0.0.1", silent.getsockname()[1])], patience=0.1)
    assert report.trouble == "no answer in time"
