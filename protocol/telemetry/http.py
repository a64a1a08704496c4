"""An app behind a port, served from a thread of its own."""

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
"""Seconds that the end waits for the thread; a process' end waits no longer for a monitor."""

_LONGEST_REQUEST = 1
"""Seconds that a request may still take once the end has come."""

_BACKLOG = 64


@contextmanager
def served(app: FastAPI, at: Endpoint) -> Generator[Endpoint]:
    """Answer HTTP for as long as this is open; gives where, with the port that the system chose for port 0.

    Raises:
        AddressUnavailable: the port is in use, or the host is none of this machine's.
    """
    with closing(_listening(at)) as listening:
        bound = replace(at, port=int(listening.getsockname()[1]))
        server = uvicorn.Server(_config(app))
        thread = threading.Thread(target=_serve, args=(server, listening), name="http", daemon=True)
        thread.start()
        _log.info("how this process is: http://%s", bound)
        if not bound.is_loopback:
            _log.warning("anyone who gets to %s may read how this process is; nothing of it is encrypted", bound)
        try:
            yield bound
        finally:
            server.should_exit = True
            thread.join(_LONGEST_GOODBYE)


def _config(app: FastAPI) -> uvicorn.Config:
    """Uvicorn as a guest: it sets up no logging, and since it runs in a thread, handles no signals either."""
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
        _log.exception("this process answers no HTTP any more")


def _listening(at: Endpoint) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            at.host, at.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        opened = socket.socket(family, kind, protocol)
    except OSError as error:
        raise AddressUnavailable(f"HTTP can't be served at {at}: {error.strerror}") from error
    try:
        # A port that a process before this one has used may still have old connections.
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind(address)
        opened.listen(_BACKLOG)
    except OSError as error:
        opened.close()
        reason = f"HTTP can't be served at {at}: {error.strerror}; end who listens there or choose another port"
        raise AddressUnavailable(reason) from error
    return opened
