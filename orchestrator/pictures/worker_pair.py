"""One render and one perception worker, for looking at a few scenes outside of any run."""

from collections.abc import Generator
from contextlib import contextmanager

from msgspec import Struct
from msgspec.structs import replace

from orchestrator.local_workers import local_workers
from orchestrator.monitoring.live_display import Display
from orchestrator.supervision.launch import Launch
from protocol.client.client import Client
from protocol.config import RunConfig
from protocol.messages import Role
from protocol.system.stop_request import StopRequest
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
    with local_workers(config, timeouts, display=display, stop=stop) as (launches, _):
        render, perception = launches
        with _client(render, timeouts) as renderer, _client(perception, timeouts) as perceiver:
            yield WorkerPair(renderer, perceiver)


def _client(worker: Launch, timeouts: Timeouts) -> Client:
    return Client(str(worker.address), role=Role.ORCHESTRATOR, serves=worker.role, timeouts=timeouts)
