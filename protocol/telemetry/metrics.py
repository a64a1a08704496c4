"""The metrics of every process. docs/metrics.md lists them."""

from collections.abc import Callable, Iterable, Mapping, Sequence

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.process_collector import ProcessCollector
from prometheus_client.registry import Collector

from protocol import errors
from protocol.client.diagnosis import Standing
from protocol.client.pool import Pool
from protocol.failure import DRAINING, OVERLOADED, code_of
from protocol.messages import Pong, Role
from protocol.observer import Finished

BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
"""Seconds: from a cached answer to a call's usual deadline."""

OTHER = "other"
_OWN_CODES = {DRAINING, OVERLOADED, "internal", "unsupported"}


def _known_codes() -> frozenset[str]:
    kinds = (kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, Exception))
    return frozenset(_OWN_CODES | {code_of(kind) for kind in kinds})


class RequestMetrics:
    """Counts the requests that have ended, and the seconds that they waited and were computed."""

    def __init__(self, registry: CollectorRegistry) -> None:
        self._codes = _known_codes()
        self._requests = Counter(
            "vantage_requests", "Requests that are over", ("type", "outcome", "code"), registry=registry
        )
        self._queue = _seconds("queue", "that requests waited for a handler", registry)
        self._compute = _seconds("compute", "that a handler took", registry)

    def count(self, request: Finished) -> None:
        """A request has ended."""
        # The code may come from a worker behind this one, which must not fill this process's memory with new codes.
        code = request.code if not request.code or request.code in self._codes else OTHER
        self._requests.labels(request.request, request.outcome.value, code).inc()
        if request.queue is not None:
            self._queue.labels(request.request).observe(request.queue)
        if request.compute is not None:
            self._compute.labels(request.request).observe(request.compute)


def _seconds(name: str, what: str, registry: CollectorRegistry) -> Histogram:
    return Histogram(
        f"vantage_request_{name}_seconds", f"Seconds {what}", ("type",), registry=registry, buckets=BUCKETS
    )


class WorkerCollector(Collector):
    """The metrics in a worker's pong; none while `pong` returns None."""

    def __init__(self, pong: Callable[[], Pong | None]) -> None:
        self._pong = pong

    def collect(self) -> Iterable[Metric]:
        """The metrics as they are now."""
        pong = self._pong()
        if pong is None:
            return
        yield GaugeMetricFamily("vantage_requests_in_flight", "Requests taken and not yet answered", pong.queue_depth)
        yield CounterMetricFamily(
            "vantage_malformed_messages", "What came and was no message that can be read", pong.malformed
        )


class CallCollector(Collector):
    """The counts of the process's clients, by the role that they call."""

    def __init__(self, calls: Mapping[Role, Pool]) -> None:
        self._calls = calls

    def collect(self) -> Iterable[Metric]:
        """The metrics as they are now."""
        counts = {role.value: pool.statistics for role, pool in self._calls.items()}
        yield _counter("retries", "Calls that were sent again", {to: one.retries for to, one in counts.items()})
        yield _counter("losses", "Calls lost with their worker", {to: one.losses for to, one in counts.items()})
        yield _counter("late_replies", "Replies too late", {to: one.late_replies for to, one in counts.items()})
        yield _counter("malformed_replies", "What was no reply", {to: one.malformed for to, one in counts.items()})
        workers = GaugeMetricFamily("vantage_workers", "Workers that are known", labels=("serves", "at_work"))
        yield counted(workers, {role: pool.standings() for role, pool in self._calls.items()})


def counted(gauge: GaugeMetricFamily, standings: Mapping[Role, Sequence[Standing]]) -> Metric:
    """Fill a gauge with the number of workers by the labels role and whether they are at work."""
    for role, ones in standings.items():
        for at_work in (True, False):
            gauge.add_metric((role.value, str(at_work).lower()), sum(one.at_work is at_work for one in ones))
    return gauge


def _counter(name: str, what: str, counts: Mapping[str, int]) -> Metric:
    family = CounterMetricFamily(f"vantage_call_{name}", what, labels=("serves",))
    for role, count in counts.items():
        family.add_metric((role,), count)
    return family


class ReadyCollector(Collector):
    """1 while the process is ready, else 0."""

    def __init__(self, is_ready: Callable[[], bool]) -> None:
        self._is_ready = is_ready

    def collect(self) -> Iterable[Metric]:
        """The metric as it is now."""
        yield GaugeMetricFamily("vantage_ready", "Whether the process is ready", float(self._is_ready()))


def process_registry(is_ready: Callable[[], bool], calls: Mapping[Role, Pool]) -> CollectorRegistry:
    """A registry with the metrics that every process has."""
    registry = CollectorRegistry()
    ProcessCollector(namespace="vantage", registry=registry)
    registry.register(ReadyCollector(is_ready))
    if calls:
        registry.register(CallCollector(calls))
    return registry
