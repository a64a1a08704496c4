import logging
import signal
import socket
import threading
from contextlib import ExitStack, closing

import httpx
import pytest
from fastapi import FastAPI, Response

from protocol.errors import AddressUnavailable
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.http import served
from tests.protocol.telemetry.monitors import free_endpoint, monitoring

ANY = Endpoint("127.0.0.1", 0)


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    async def hello() -> Response:
        return Response("hello")

    async def broken() -> Response:
        raise RuntimeError("it is broken")

    app.get("/hello")(hello)
    app.get("/broken")(broken)
    return app


def test_port_0_is_one_that_the_system_chooses(app):
    with served(app, ANY) as at, monitoring(at) as monitor:
        assert at.port != 0
        assert monitor.get("/hello").text == "hello"


def test_the_port_is_free_again_at_the_end_and_the_thread_gone(app):
    at = free_endpoint()
    for _ in range(2):
        with served(app, at), monitoring(at) as monitor:
            assert monitor.get("/hello").text == "hello"
    with pytest.raises(httpx.ConnectError), monitoring(at) as monitor:
        monitor.get("/hello")
    assert "http" not in {thread.name for thread in threading.enumerate()}


def test_a_monitor_that_stays_connected_does_not_hold_up_the_end(app):
    with ExitStack() as stays:
        with served(app, ANY) as at:
            monitor = stays.enter_context(monitoring(at))
            monitor.get("/hello")
            silent = stays.enter_context(closing(socket.create_connection((at.host, at.port))))
            silent.send(b"GET /hello HTTP/1.1\r\n")
        assert "http" not in {thread.name for thread in threading.enumerate()}


def test_a_port_in_use_is_told(app):
    with (
        closing(socket.create_server(("127.0.0.1", 0))) as other,
        pytest.raises(AddressUnavailable, match=r"127\.0\.0\.1:\d+: .*in use; .* choose another port"),
        served(app, Endpoint("127.0.0.1", other.getsockname()[1])),
    ):
        pass


@pytest.mark.parametrize("host", ["192.0.2.1", "no-such-host.invalid"])
def test_a_host_that_is_not_this_machine_is_told(app, host):
    with pytest.raises(AddressUnavailable, match=f"can't be served at {host}"), served(app, Endpoint(host, 0)):
        pass


def test_only_beyond_loopback_a_warning_says_who_may_read(app, caplog):
    with served(app, ANY):
        assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
    with served(app, Endpoint("0.0.0.0", 0)):
        assert "every machine that reaches 0.0.0.0:" in caplog.text


def test_signals_and_logs_stay_ours(app, caplog):
    caplog.set_level(logging.INFO)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    before = list(logging.getLogger().handlers)
    with served(app, ANY) as at, monitoring(at) as monitor:
        monitor.get("/hello")
        assert handlers == {number: signal.getsignal(number) for number in handlers}
        assert signal.set_wakeup_fd(-1) == -1
    assert logging.getLogger().handlers == before
    assert all(not logging.getLogger(name).handlers for name in ("uvicorn", "uvicorn.error", "uvicorn.access"))
    assert {record.name for record in caplog.records if record.name.startswith("uvicorn")} == set()


def test_an_endpoint_that_is_broken_is_logged_and_the_others_go_on(app, caplog):
    with served(app, ANY) as at:
        for path, status in (("/broken", 500), ("/hello", 200)):
            with monitoring(at) as monitor:
                assert monitor.get(path).status_code == status
    assert "it is broken" in caplog.text
