from prometheus_client import CollectorRegistry

from protocol.messages import Failure, SampleScene
from protocol.observer import Finished, Outcome, handled, refused
from protocol.telemetry.metrics import OTHER, RequestMetrics
from tests.protocol.processes.calls import ask
from tests.protocol.workers.scenes import scene_for


def counted(*requests: Finished) -> CollectorRegistry:
    registry = CollectorRegistry()
    metrics = RequestMetrics(registry)
    for request in requests:
        metrics.count(request)
    return registry


def requests(registry: CollectorRegistry, outcome: str, code: str = "") -> float | None:
    labels = {"type": "SampleScene", "outcome": outcome, "code": code}
    return registry.get_sample_value("vantage_requests_total", labels)


def test_queue_and_compute_are_told_apart():
    registry = counted(handled(ask(1), scene_for(1), queue=0.25, compute=2.0))
    for name, seconds in (("queue", 0.25), ("compute", 2.0)):
        full_name = f"vantage_request_{name}_seconds"
        assert registry.get_sample_value(f"{full_name}_sum", {"type": "SampleScene"}) == seconds
        assert registry.get_sample_value(f"{full_name}_count", {"type": "SampleScene"}) == 1
    assert requests(registry, "answered") == 1


def test_a_handler_that_fails_took_its_time():
    registry = counted(handled(ask(1), Failure(code="invalid-input", message=""), queue=0.0, compute=3.0))
    assert requests(registry, "failed", "invalid-input") == 1
    assert registry.get_sample_value("vantage_request_compute_seconds_sum", {"type": "SampleScene"}) == 3.0


def test_what_no_handler_saw_was_not_computed():
    failure = Failure(code="deadline-exceeded", message="")
    registry = counted(refused(ask(1), failure, queue=4.0), refused(ask(1), Failure(code="draining", message="")))
    assert requests(registry, "refused", "deadline-exceeded") == 1
    assert requests(registry, "refused", "draining") == 1
    assert registry.get_sample_value("vantage_request_queue_seconds_sum", {"type": "SampleScene"}) == 4.0
    assert registry.get_sample_value("vantage_request_queue_seconds_count", {"type": "SampleScene"}) == 1
    assert registry.get_sample_value("vantage_request_compute_seconds_count", {"type": "SampleScene"}) is None


def test_codes_that_a_worker_makes_up_are_counted_as_one():
    made_up = [
        Finished(request=SampleScene.__name__, outcome=Outcome.FAILED, code=f"code-{number}") for number in range(50)
    ]
    assert requests(counted(*made_up), "failed", OTHER) == 50
