"""How any process is, behind an HTTP port: what worker and agent have in common."""

import os
import signal
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from protocol.client.pool import Pool
from protocol.errors import Unavailable
from protocol.messages import Role
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.subject import Subject

if TYPE_CHECKING:
    from prometheus_client import CollectorRegistry


@contextmanager
def process_telemetry(at: Endpoint, subject: Subject, calls: Mapping[Role, Pool]) -> Generator["CollectorRegistry"]:
    """Serve how a process is; gives the registry, for the metrics that are its own.

    Args:
        calls: its clients of other workers, by the role of these; their idle workers are pinged from now on.

    Raises:
        AddressUnavailable: the port is in use, or the host is none of this machine's.
        Unavailable: a library that this needs is not installed.
    """
    with needs_libraries():
        # Only here: who is not to serve this does not load it.
        from protocol.telemetry.app import Control, telemetry_app
        from protocol.telemetry.http import served
        from protocol.telemetry.metrics import process_registry
    registry = process_registry(lambda: not any(subject.waits()), calls)
    control = Control(at.token, _end_this_process) if at.token else None
    with served(telemetry_app(subject, registry, control), at):
        for pool in calls.values():
            pool.monitor()
        yield registry


def _end_this_process() -> None:
    # As any service manager asks for it: what follows is what the process does about that.
    os.kill(os.getpid(), signal.SIGTERM)


@contextmanager
def needs_libraries() -> Generator[None]:
    """Say what to install where an import fails."""
    try:
        yield
    except ImportError as error:
        raise Unavailable(f"--http needs {error.name}, which is not installed; this room's extra has it") from error
