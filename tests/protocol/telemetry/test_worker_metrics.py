"""What a worker's metrics say is what really came of its requests and calls."""

import sys

import pytest

from protocol import Limits, Pool
from protocol.errors import InvalidInput, Rejected
from protocol.messages import Render, Role, SampleScene
from tests.protocol.processes.bare_client import bare_client
from tests.protocol.processes.calls import PATIENT, ask, client_of
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.observing import Held, observed
from tests.protocol.values.samples import CAMERA, SCENE
from tests.protocol.workers.scenes import scene_for


def total(monitor, outcome, code="", kind="SampleScene"):
    return monitor.metric("vantage_requests_total", type=kind, outcome=outcome, code=code)


def test_answers_failures_and_refusals_are_counted_as_what_they_were(address):
    def sample(request):
        if request.seed == 3:
            raise InvalidInput("not three")
        if request.seed == 4:
            raise RuntimeError("an accident")
        return scene_for(request.seed)

    with observed(address, {SampleScene: sample}) as monitor, client_of(address) as client:
        client.call(ask(1))
        client.call(ask(2))
        for request in (ask(3), ask(4), Render(scene=SCENE, camera=CAMERA)):
            with pytest.raises(Rejected):
                client.call(request)
        wait_until(lambda: total(monitor, "refused", "unsupported", "Render") == 1)
        assert total(monitor, "answered") == 2
        assert total(monitor, "failed", "invalid-input") == 1
        assert total(monitor, "failed", "internal") == 1
        assert monitor.metric("vantage_request_queue_seconds_count", type="SampleScene") == 4
        assert monitor.metric("vantage_request_compute_seconds_count", type="SampleScene") == 4


def test_what_is_turned_away_at_the_door_is_counted(address):
    held = Held()
    with (
        observed(address, held.handlers, limits=Limits(queue=1)) as monitor,
        bare_client(address) as client,
    ):
        client.ask(ask(1), 1)
        assert held.begun.wait(20)
        client.ask(ask(2), 2)
        client.receive()
        assert monitor.metric("vantage_requests_in_flight") == 1
        wait_until(lambda: total(monitor, "refused", "overloaded") == 1)
        held.may_end.set()
        wait_until(lambda: total(monitor, "answered") == 1)
        wait_until(lambda: monitor.metric("vantage_requests_in_flight") == 0)


def test_one_that_expires_in_the_queue_is_refused(address):
    held = Held()
    with observed(address, held.handlers) as monitor, bare_client(address) as client:
        client.ask(ask(1), 1)
        assert held.begun.wait(20)
        client.ask(ask(2), 2, deadline=0.0)
        wait_until(lambda: monitor.metric("vantage_requests_in_flight") == 2)
        held.may_end.set()
        wait_until(lambda: total(monitor, "refused", "deadline-exceeded") == 1)
        assert total(monitor, "answered") == 1


def test_noise_is_counted(address):
    with observed(address) as monitor, bare_client(address) as client:
        assert monitor.metric("vantage_malformed_messages_total") == 0
        client.send([b"noise"])
        wait_until(lambda: monitor.metric("vantage_malformed_messages_total") == 1)


@pytest.mark.slow
def test_calls_to_others_are_counted_by_role(address, start):
    behind = f"{address}-behind"
    with (
        Pool([behind], role=Role.PERCEPTION, serves=Role.RENDER, timeouts=PATIENT) as pool,
        observed(address, calls={Role.RENDER: pool}) as monitor,
    ):
        assert monitor.metric("vantage_call_losses_total", serves="render") == 0
        start("dies_after_hello", behind)
        pool.submit(ask(1))
        wait_until(lambda: monitor.metric("vantage_call_losses_total", serves="render") == 1)
        assert pool.statistics.losses == 1
        assert monitor.metric("vantage_call_late_replies_total", serves="render") == 0


@pytest.mark.skipif(sys.platform != "linux", reason="they come from /proc")
def test_the_process_has_memory_and_a_start(address):
    with observed(address) as monitor:
        assert (monitor.metric("vantage_process_resident_memory_bytes") or 0) > 1_000_000
        assert (monitor.metric("vantage_process_start_time_seconds") or 0) > 1_600_000_000
