"""Workers of this machine outside of any run: for a few pictures, or an experiment's many."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from orchestrator.monitoring.live_display import Display
from orchestrator.run.run_directory import resolved_toml
from orchestrator.run.run_log import log_directory
from orchestrator.run.socket_directory import socket_directory
from orchestrator.session import Session
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch, registry_address, worker_launches
from orchestrator.supervision.registry import Registry, serve_registry
from orchestrator.supervision.supervisor import Supervisor
from protocol.config import RunConfig
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts


class LocalWorkers(NamedTuple):
    """The workers as they were started, and the session that attends to them."""

    launches: Sequence[Launch]
    session: Session


@contextmanager
def local_workers(
    config: RunConfig, timeouts: Timeouts, *, display: Display, stop: StopRequest
) -> Generator[LocalWorkers]:
    """The workers that a configuration asks for, ready and supervised; none is left when this ends.

    Raises:
        ProcessFailed, DeadlineExceeded, Interrupted: as for a training.
    """
    logs = log_directory()
    with (
        socket_directory() as sockets,
        serve_registry(Registry(timeouts.liveness), registry_address(sockets), timeouts),
        _written(config, logs) as config_path,
        Fleet(logs, stop, sockets=sockets) as fleet,
        Supervisor(fleet, config.supervision, timeouts) as supervisor,
    ):
        launches = worker_launches(config, config_path, sockets)
        session = Session(fleet, supervisor, display, stop)
        session.start_workers(launches)
        yield LocalWorkers(launches, session)


@contextmanager
def _written(config: RunConfig, logs: Path) -> Generator[Path]:
    """A file with the configuration, beside logs: not beside the sockets, which may be removed under us from /tmp."""
    logs.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".workers-", dir=logs, ignore_cleanup_errors=True) as directory:
        path = Path(directory) / "config.toml"
        path.write_bytes(resolved_toml(config))
        yield path
