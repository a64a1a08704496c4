"""Serves an HTTP app in a thread of its own."""

import logging
import socket
import threading
from collections.abc import Generator
from contextlib import closing, contextmanager

import uvicorn
from fastapi import FastAPI
from msgspec.structs import replace

from protocol.errors import AddressUnavailable
from protocol.telemetry.endpoint import Endpoint

_log = logging.getLogger(__name__)

_LONGEST_GOODBYE = 3.0
"""Seconds that the process, as it ends, waits for the HTTP thread."""

_LONGEST_REQUEST = 1
"""Seconds that a request may still take once the server stops."""

_BACKLOG = 64


@contextmanager
def served(app: FastAPI, at: Endpoint) -> Generator[Endpoint]:
    """Serve HTTP while inside; yields the endpoint, with the port that the system chose for port 0.

    Raises:
        AddressUnavailable: the port is in use, or this machine does not have the host's address.
    """
    with closing(_listening(at)) as listening:
        bound = replace(at, port=int(listening.getsockname()[1]))
        server = uvicorn.Server(_config(app))
        thread = threading.Thread(target=_serve, args=(server, listening), name="http", daemon=True)
        thread.start()
        _log.info("health and metrics of this process: http://%s", bound)
        if not bound.is_loopback:
            _log.warning("every machine that reaches %s can read this process's health and metrics, unencrypted", bound)
        try:
            yield bound
        finally:
            server.should_exit = True
            thread.join(_LONGEST_GOODBYE)


def _config(app: FastAPI) -> uvicorn.Config:
    """Uvicorn without logging of its own; since it runs in a thread, it handles no signals either."""
    return uvicorn.Config(
        app,
        loop="asyncio",
        http="h11",
        ws="none",
        lifespan="off",
        log_config=None,
        log_level=logging.WARNING,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=_LONGEST_REQUEST,
    )


def _serve(server: uvicorn.Server, listening: socket.socket) -> None:
    try:
        server.run(sockets=[listening])
    except Exception:
        _log.exception("the HTTP thread failed; this process answers no HTTP any more")


def _listening(at: Endpoint) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            at.host, at.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        opened = socket.socket(family, kind, protocol)
    except OSError as error:
        raise AddressUnavailable(f"HTTP can't be served at {at}: {error.strerror}") from error
    try:
        # The port may still have old connections of an earlier process.
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind(address)
        opened.listen(_BACKLOG)
    except OSError as error:
        opened.close()
        advice = "stop the process that listens there, or choose another port"
        reason = f"HTTP can't be served at {at}: {error.strerror}; {advice}"
        raise AddressUnavailable(reason) from error
    return opened
