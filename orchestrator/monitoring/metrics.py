"""The orchestrator's own metrics. docs/metrics.md lists them."""

from collections.abc import Callable, Iterable, Iterator

from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from orchestrator.monitoring.live_display import Snapshot
from orchestrator.monitoring.standings import standings_by_role
from protocol.telemetry.metrics import counted


class ProcessCollector(Collector):
    """Counts the processes at work, as of the last snapshot; nothing before the first."""

    def __init__(self, snapshot: Callable[[], Snapshot | None]) -> None:
        self._snapshot = snapshot

    def collect(self) -> Iterable[Metric]:
        """The metrics as of the last snapshot."""
        snapshot = self._snapshot()
        if snapshot is not None:
            yield from self._tell(snapshot)

    def _tell(self, snapshot: Snapshot) -> Iterator[Metric]:
        processes = GaugeMetricFamily("vantage_processes", "Processes of the run", labels=("role", "at_work"))
        yield counted(processes, standings_by_role(snapshot))


class RunCollector(ProcessCollector):
    """The metrics of a run's last snapshot, restarts included."""

    def _tell(self, snapshot: Snapshot) -> Iterator[Metric]:
        restarts = CounterMetricFamily("vantage_restarts", "Unplanned restarts", labels=("process",))
        # Workers on other machines may have the same name, and a sample may appear only once.
        names = dict.fromkeys(health.name for health in snapshot.workers)
        for name in names:
            restarts.add_metric((name,), sum(one.restarts for one in snapshot.workers if one.name == name))
        yield restarts
        yield from super()._tell(snapshot)
