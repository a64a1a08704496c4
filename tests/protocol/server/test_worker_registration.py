"""A worker is registered while it serves, and ends by itself once it is an orphan or the run is over."""

import os
import signal
import threading
from collections.abc import Callable

import pytest

from protocol import Handlers, Pool, Timeouts, serve
from protocol.errors import AddressUnavailable
from protocol.messages import Drain, Role, SampleScene, State
from protocol.server.registration_settings import RegistrationSettings
from tests.protocol.processes.calls import PATIENT, ask, client_of
from tests.protocol.processes.registry import Registry, record
from tests.protocol.processes.serving import SCENES, serving
from tests.protocol.processes.waiting import wait_until
from tests.protocol.workers.scenes import scene_for

LONG = Timeouts(call=20.0, heartbeat=0.02, grace=60.0)
BRIEF = Timeouts(call=20.0, heartbeat=0.02, liveness=0.1, grace=0.3)


@pytest.fixture
def orchestrator(address) -> str:
    return f"{address}-orchestrator"


@pytest.fixture
def registry(orchestrator):
    kept = Registry()
    with serving(orchestrator, kept.handlers(), role=Role.ORCHESTRATOR):
        yield kept


def serving_thread(
    address: str, load: Callable[[], Handlers], registration: RegistrationSettings, timeouts: Timeouts
) -> threading.Thread:
    """A worker that ends when its orchestrator or its client tells it to."""
    options = {"role": Role.RENDER, "bind": address, "registration": registration, "timeouts": timeouts}
    thread = threading.Thread(target=serve, args=(load,), kwargs=options, daemon=True)
    thread.start()
    return thread


def test_a_worker_is_registered_in_every_state_of_its_life(address, orchestrator, registry):
    may_load, may_answer = threading.Event(), threading.Event()

    def load():
        may_load.wait(20)
        return {SampleScene: sample}

    def sample(request: SampleScene):
        may_answer.wait(20)
        return scene_for(request.seed)

    def state() -> State | None:
        known = registry.table.get("render-3")
        return known and known.state

    worker = serving_thread(address, load, RegistrationSettings(orchestrator, "render-3"), LONG)
    with client_of(address) as client:
        wait_until(lambda: state() is State.STARTING)
        may_load.set()
        wait_until(lambda: state() is State.READY)
        pending = client.submit(ask(1))
        wait_until(lambda: state() is State.BUSY)
        drained = client.submit(Drain())
        wait_until(lambda: state() is State.DRAINING)
        known, incarnation = registry.table["render-3"], client.ping().incarnation
        may_answer.set()
        assert pending.result().scene.yaw == 1
        drained.result()
        worker.join(20)
    assert (known.role, known.address, known.pid) == (Role.RENDER, address, os.getpid())
    assert known.incarnation == incarnation


def test_a_pool_of_a_worker_follows_the_table(address, orchestrator, registry):
    behind = f"{address}-behind"
    registry.table["render-0"] = record("render-0", behind, Role.RENDER)
    with (
        serving(behind),
        Pool([], role=Role.PERCEPTION, serves=Role.RENDER, timeouts=PATIENT) as pool,
        serving(
            address,
            {SampleScene: pool.call},
            role=Role.PERCEPTION,
            registration=RegistrationSettings(orchestrator, "perception-0", {Role.RENDER: pool}),
            timeouts=LONG,
        ),
        client_of(address) as client,
    ):
        assert client.call(ask(5)).scene.yaw == 5


def assert_answers_and_ends(address, orchestrator, timeouts, until_it_drains):
    """A worker with a request in hand drains, answers the request, and ends."""
    begun, may_answer = threading.Event(), threading.Event()

    def sample(request: SampleScene):
        begun.set()
        may_answer.wait(20)
        return scene_for(request.seed)

    worker = serving_thread(
        address, lambda: {SampleScene: sample}, RegistrationSettings(orchestrator, "render-0"), timeouts
    )
    with client_of(address) as client:
        pending = client.submit(ask(2))
        assert begun.wait(20)
        until_it_drains(client)
        may_answer.set()
        assert pending.result().scene.yaw == 2
        worker.join(20)
    assert not worker.is_alive()


def test_an_orphan_answers_what_it_has_in_hand_and_ends(address, orchestrator):
    def until_it_drains(client):
        wait_until(lambda: client.ping().state is State.DRAINING)

    assert_answers_and_ends(address, orchestrator, BRIEF, until_it_drains)


def test_a_worker_that_hears_that_the_run_is_over_answers_what_it_has_in_hand_and_ends(address, orchestrator, registry):
    def until_it_drains(_):
        registry.over = True
        wait_until(lambda: registry.state("render-0") is State.DRAINING)

    assert_answers_and_ends(address, orchestrator, LONG, until_it_drains)


def test_an_orchestrator_whose_address_is_none_is_told(address):
    with pytest.raises(AddressUnavailable):
        serve(lambda: SCENES, role=Role.RENDER, bind=address, registration=RegistrationSettings("nowhere", "render-0"))


@pytest.mark.slow
class TestOrphanedProcess:
    @pytest.fixture
    def orchestrating(self, orchestrator, start):
        """An orchestrator's process, which answers before any process misses it."""
        process = start("keeps_a_registry", orchestrator)
        with client_of(orchestrator) as client:
            client.wait_ready()
        return process

    def test_one_that_is_ready_ends_well(self, address, orchestrator, orchestrating, start):
        worker = start("joins_an_orchestrator", address, orchestrator)
        with client_of(address) as client:
            client.wait_ready()
            assert client.call(ask(1)).scene.yaw == 1
            orchestrating.kill()
            assert worker.wait(20) == 0

    def test_one_that_still_starts_ends_well(self, address, orchestrator, start):
        worker = start("joins_an_orchestrator", address, orchestrator, "starts for ever")
        with client_of(address) as client:
            assert client.ping().state is State.STARTING
            assert worker.wait(20) == 0

    def test_one_that_hangs_ends_all_the_same(self, address, orchestrator, orchestrating, start):
        worker = start("joins_an_orchestrator", address, orchestrator, "hangs")
        with client_of(address) as client:
            client.wait_ready()
            client.submit(ask(1))
            wait_until(lambda: client.ping().queue_depth == 1)
            orchestrating.kill()
            assert worker.wait(20) == 3

    def test_one_that_was_stopped_for_a_while_is_none(self, address, orchestrator, orchestrating, start):
        worker = start("joins_an_orchestrator", address, orchestrator)
        with client_of(address) as client:
            before = client.wait_ready()
            worker.send_signal(signal.SIGSTOP)
            threading.Event().wait(4.0)
            worker.send_signal(signal.SIGCONT)
            assert client.call(ask(1)).scene.yaw == 1
            threading.Event().wait(1.0)
            assert client.ping().incarnation == before.incarnation
