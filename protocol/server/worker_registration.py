"""Registers a worker while it serves, and ends it when it is an orphan or the run is over.

The worker drains, as after SIGTERM. If a handler hangs, so that it can't drain, the process ends without it.
"""

import logging
import os
import signal
import socket
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager

from msgspec.structs import replace

from protocol.messages import WorkerRecord
from protocol.security import LOCAL_ONLY, Security
from protocol.server.listener import Listener
from protocol.server.registration import Registration
from protocol.server.registration_settings import RegistrationSettings
from protocol.system.exit_code import ExitCode
from protocol.timeouts import Timeouts
from protocol.transport.address import reachable

_log = logging.getLogger(__name__)

_AFTER_THE_AGENT = 1.25
"""Workers stay for this many times the grace period: the agent becomes an orphan first, and flies one last step."""


@contextmanager
def registered(
    settings: RegistrationSettings, listener: Listener, bind: str, timeouts: Timeouts, security: Security = LOCAL_ONLY
) -> Generator[None]:
    """Register a worker that is served from the calling thread, and end it once it is an orphan or the run is over."""
    address = settings.advertised or reachable(bind, socket.gethostname())
    credentials = security.credentials_for(bind)
    key = credentials.own.public if credentials else ""

    def describe() -> WorkerRecord:
        return WorkerRecord(
            role=listener.role,
            address=address,
            key=key,
            incarnation=listener.incarnation,
            state=listener.state,
            name=settings.name,
            pid=os.getpid(),
        )

    with ExitStack() as held:
        end = _end_of(listener, held, timeouts)
        patience = replace(timeouts, grace=_AFTER_THE_AGENT * timeouts.grace)
        registration = Registration(
            settings.orchestrator,
            describe=describe,
            on_orphaned=end,
            on_over=end,
            timeouts=patience,
            security=security,
        )
        held.enter_context(registration)
        for role, pool in settings.follows.items():
            registration.follow(pool, role)
        yield


def _end_of(listener: Listener, held: ExitStack, timeouts: Timeouts) -> Callable[[], None]:
    """The function that ends the worker which the calling thread serves."""
    if threading.current_thread() is not threading.main_thread():
        return listener.drain
    # No client waits longer than this for the requests in hand.
    last_resort = threading.Timer(timeouts.call, _give_up)
    last_resort.daemon = True
    held.callback(last_resort.cancel)

    def end() -> None:
        last_resort.start()
        # A signal also ends a worker that still starts; `drain` does not.
        os.kill(os.getpid(), signal.SIGTERM)

    return end


def _give_up() -> None:
    _log.error("a handler hangs; ending without it")
    os._exit(ExitCode.FAILED)
