"""The state of the agent's process, over HTTP: ready while it flies and each role has a worker at work."""

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

from agent.connections import Connections
from agent.observer import NO_OBSERVER, Observer
from protocol.observer import Turning
from protocol.telemetry.endpoint import Endpoint
from protocol.telemetry.info import About, Info, info
from protocol.telemetry.process import needs_libraries, process_telemetry
from protocol.telemetry.readiness import Wait, waits_for_any
from protocol.telemetry.subject import addresses_called


class ObservedAgent:
    """An agent that can be asked how it is.

    Args:
        has_begun: whether it flies.
    """

    def __init__(self, about: About, connections: Connections, has_begun: Callable[[], bool]) -> None:
        self._about = about
        self._connections = connections
        self._has_begun = has_begun

    def threads(self) -> Iterator[Turning]:
        """Those of the clients that it calls the workers with."""
        yield from self._connections.calls.values()

    def waits(self) -> Iterator[Wait]:
        """Its own start, and the workers that it needs: one of each role."""
        if not self._has_begun():
            yield Wait("start", "it has not begun to fly")
        for role, pool in self._connections.calls.items():
            yield from waits_for_any(role, pool.standings())

    def info(self) -> Info:
        """What the process is."""
        connections = self._connections
        return info(self._about, incarnation=connections.incarnation, calls=addresses_called(connections.calls))


@contextmanager
def agent_telemetry(
    at: Endpoint | None,
    about: About,
    connections: Connections,
    checkpoints: Path,
    updates: Callable[[], int] | None = None,
) -> Generator[Observer]:
    """Serve how the agent is at an endpoint, or nowhere; gives who is to be told how far it is.

    Raises:
        AddressUnavailable: the port is in use, or the host is none of this machine's.
        Unavailable: a library that this needs is not installed.
    """
    if at is None:
        yield NO_OBSERVER
        return
    with needs_libraries():
        # Only here: who is not to serve this does not load it.
        from agent.metrics import TrainingMetrics
    metrics = TrainingMetrics(checkpoints, updates)
    watched = ObservedAgent(about, connections, lambda: metrics.has_begun)
    with process_telemetry(at, watched, connections.calls) as registry:
        registry.register(metrics)
        yield metrics
