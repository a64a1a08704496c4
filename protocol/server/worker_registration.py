"""How a worker is a member: registered while it serves, on its way out once it is an orphan or the run is over.

It drains as after SIGTERM. One that can't, since a handler of it hangs, is ended all the same.
"""

import argparse
import logging
import os
import signal
import socket
import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

from msgspec.structs import replace

from protocol.client.pool import Pool
from protocol.messages import Role, WorkerRecord
from protocol.security import LOCAL_ONLY, Security
from protocol.server.listener import Listener
from protocol.server.membership import Membership
from protocol.system.exit_code import ExitCode
from protocol.timeouts import Timeouts
from protocol.transport.address import reachable

_log = logging.getLogger(__name__)

_AFTER_THE_AGENT = 1.25
"""Workers stay for this many times the grace: the agent, an orphan at that very moment, has a last step to fly."""


class WorkerRegistration(NamedTuple):
    """With which orchestrator a worker registers, under which name, and which pools follow what it learns there.

    `advertised` is where others reach it, if that is not where it binds.
    """

    orchestrator: str
    name: str
    follows: Mapping[Role, Pool] = {}
    advertised: str | None = None


ADVERTISE_HELP = "where others reach it, if not at --bind (default for a bind to every interface: this host's name)"


def registration_of(options: argparse.Namespace) -> WorkerRegistration | None:
    """What a worker's options `--orchestrator`, `--name` and `--advertise` come to."""
    if options.orchestrator is None:
        return None
    return WorkerRegistration(options.orchestrator, options.name, advertised=options.advertise)


@contextmanager
def registered(
    registration: WorkerRegistration, listener: Listener, bind: str, timeouts: Timeouts, security: Security = LOCAL_ONLY
) -> Generator[None]:
    """Register a worker that is served from the calling thread, and have it end when that is due."""
    address = registration.advertised or reachable(bind, socket.gethostname())
    credentials = security.credentials_for(bind)
    key = credentials.own.public if credentials else ""

    def describe() -> WorkerRecord:
        return WorkerRecord(
            role=listener.role,
            address=address,
            key=key,
            incarnation=listener.incarnation,
            state=listener.state,
            name=registration.name,
            pid=os.getpid(),
        )

    with ExitStack() as held:
        end = _end_of(listener, held, timeouts)
        patience = replace(timeouts, grace=_AFTER_THE_AGENT * timeouts.grace)
        membership = Membership(
            registration.orchestrator,
            describe=describe,
            on_orphaned=end,
            on_over=end,
            timeouts=patience,
            security=security,
        )
        held.enter_context(membership)
        for role, pool in registration.follows.items():
            membership.follow(pool, role)
        yield


def _end_of(listener: Listener, held: ExitStack, timeouts: Timeouts) -> Callable[[], None]:
    """What ends the worker that the calling thread serves."""
    if threading.current_thread() is not threading.main_thread():
        return listener.drain
    # Nobody waits for what is in hand any longer than a call may take.
    last_resort = threading.Timer(timeouts.call, _give_up)
    last_resort.daemon = True
    held.callback(last_resort.cancel)

    def end() -> None:
        last_resort.start()
        # Unlike a call to `drain`, a signal also reaches a worker that still starts.
        os.kill(os.getpid(), signal.SIGTERM)

    return end


def _give_up() -> None:
    _log.error("a handler hangs; ending without it")
    os._exit(ExitCode.FAILED)
