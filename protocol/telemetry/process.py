"""The HTTP endpoints that workers and agents have in common."""

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
    """Serve the endpoints of a process while inside; yields the registry, for metrics of the process's own.

    Args:
        calls: the process's pools, by the role of their workers; idle workers are pinged from now on.

    Raises:
        AddressUnavailable: the port is in use, or this machine does not have the host's address.
        Unavailable: a library that this needs is not installed.
    """
    with needs_libraries():
        # Only here: a process that does not serve HTTP does not load these.
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
    # The signal of any service manager, which the process handles already.
    os.kill(os.getpid(), signal.SIGTERM)


@contextmanager
def needs_libraries() -> Generator[None]:
    """Turn a failed import into an error that says what to install."""
    try:
        yield
    except ImportError as error:
        raise Unavailable(f"--http needs {error.name}, which is not installed; this room's extra has it") from error
