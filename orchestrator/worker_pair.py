"""One render and one perception worker, for looking at a few scenes outside of any run."""

from collections.abc import Generator
from contextlib import contextmanager

from msgspec import Struct
from msgspec.structs import replace

from orchestrator.fleet import Fleet
from orchestrator.launch import Launch, registry_address, worker_launches
from orchestrator.live_display import Display
from orchestrator.registry import Registry, serve_registry
from orchestrator.run_directory import resolved_toml
from orchestrator.session import Session
from orchestrator.socket_directory import socket_directory
from orchestrator.stop_request import StopRequest
from orchestrator.supervisor import Supervisor
from protocol.artifact import cache_directory
from protocol.client import Client
from protocol.config import RunConfig
from protocol.messages import Role
from protocol.timeouts import Timeouts


class WorkerPair(Struct, frozen=True, eq=False):
    """A client of each worker."""

    renderer: Client
    perceiver: Client


@contextmanager
def worker_pair(config: RunConfig, *, display: Display, stop: StopRequest) -> Generator[WorkerPair]:
    """The two workers, ready; neither is left when this ends.

    Args:
        config: how they are to work; however many workers it asks for, there is one of each.

    Raises:
        ProcessFailed, DeadlineExceeded, Interrupted: as for a training.
    """
    config = replace(config, render=replace(config.render, workers=1), perception=replace(config.perception, workers=1))
    timeouts = Timeouts.from_config(config.timeouts)
    with (
        socket_directory() as sockets,
        serve_registry(Registry(timeouts.liveness), registry_address(sockets), timeouts),
        Fleet(cache_directory() / "logs", stop) as fleet,
        Supervisor(fleet, config.supervision, timeouts) as supervisor,
    ):
        config_path = sockets / "config.toml"
        config_path.write_bytes(resolved_toml(config))
        render, perception = worker_launches(config, config_path, sockets)
        Session(fleet, supervisor, display, stop).start_workers((render, perception))
        with _client(render, timeouts) as renderer, _client(perception, timeouts) as perceiver:
            yield WorkerPair(renderer, perceiver)


def _client(worker: Launch, timeouts: Timeouts) -> Client:
    return Client(str(worker.address), role=Role.ORCHESTRATOR, serves=worker.role, timeouts=timeouts)
