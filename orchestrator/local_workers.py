"""Workers on this machine that belong to no run: for a few pictures, or for an experiment."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from orchestrator.monitoring.live_display import Display, SilentDisplay
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.run_log import log_directory
from orchestrator.run.socket_directory import socket_directory
from orchestrator.session import Session
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch, addresses, registry_address, worker_launches
from orchestrator.supervision.registry import Registry, serve_registry
from orchestrator.supervision.supervisor import Supervisor
from protocol.client.pool import Pool
from protocol.config import RunConfig
from protocol.messages import Role
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts


class LocalWorkers(NamedTuple):
    """The launches of the workers, and the session that supervises them."""

    launches: Sequence[Launch]
    session: Session


@contextmanager
def local_workers(
    config: RunConfig, timeouts: Timeouts, *, display: Display, stop: StopRequest
) -> Generator[LocalWorkers]:
    """The workers that a configuration asks for, ready and supervised; all have ended afterwards.

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


class LocalPools(NamedTuple):
    """A pool of the workers of each role."""

    render: Pool
    perception: Pool


@contextmanager
def worker_pools(config: RunConfig | None = None) -> Generator[LocalPools]:
    """Start the workers that a configuration asks for, one of each role by default, and give pools of them.

    For programs of one's own: the pools are what `agent.environment.sensor.RemoteSensor` takes. All workers have ended
    afterwards; one that dies meanwhile is not replaced.

    Raises:
        ProcessFailed, DeadlineExceeded: a worker can't start.
    """
    config = RunConfig() if config is None else config
    timeouts = Timeouts.from_config(config.timeouts)
    with (
        local_workers(config, timeouts, display=SilentDisplay(), stop=StopRequest()) as (launches, _),
        _pool(launches, Role.RENDER, timeouts) as render,
        _pool(launches, Role.PERCEPTION, timeouts) as perception,
    ):
        yield LocalPools(render, perception)


def _pool(launches: Sequence[Launch], role: Role, timeouts: Timeouts) -> Pool:
    return Pool(addresses(launches, role), role=Role.AGENT, serves=role, timeouts=timeouts)


@contextmanager
def _written(config: RunConfig, logs: Path) -> Generator[Path]:
    """A file with the configuration, in the directory of logs: a cleaner of /tmp may remove the sockets' directory."""
    logs.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".workers-", dir=logs, ignore_cleanup_errors=True) as directory:
        path = Path(directory) / "config.toml"
        path.write_bytes(resolved_toml(config))
        yield path
