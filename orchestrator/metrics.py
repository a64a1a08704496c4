"""The orchestrator's own metrics. docs/metrics.md lists them."""

from collections.abc import Callable, Iterable

from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from orchestrator.live_display import Snapshot
from orchestrator.telemetry import standings_by_role
from protocol.telemetry.metrics import counted


class RunCollector(Collector):
    """What a run's last snapshot tells; nothing before the first."""

    def __init__(self, snapshot: Callable[[], Snapshot | None]) -> None:
        self._snapshot = snapshot

    def collect(self) -> Iterable[Metric]:
        """The metrics as of the last look at the processes."""
        snapshot = self._snapshot()
        if snapshot is None:
            return
        restarts = CounterMetricFamily("vantage_restarts", "Restarts that nobody planned", labels=("process",))
        for health in snapshot.workers:
            restarts.add_metric((health.name,), health.restarts)
        yield restarts
        processes = GaugeMetricFamily("vantage_processes", "Processes of the run", labels=("role", "at_work"))
        yield counted(processes, standings_by_role(snapshot))
