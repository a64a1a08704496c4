import threading

import pytest

from orchestrator.supervision.registry import Registry, serve_registry
from protocol.client.client import Client
from protocol.errors import AddressUnavailable
from protocol.messages import Drain, Lookup, Register, Role, State, WorkerRecord
from protocol.server.registration import Registration
from protocol.timeouts import Timeouts
from tests.orchestrator.clock import Clock

LIVENESS = 5.0


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def registry(clock) -> Registry:
    return Registry(LIVENESS, clock)


def worker(name="render-0", incarnation="a", role=Role.RENDER, state=State.READY, pid=1, address=None) -> WorkerRecord:
    address = f"ipc:///tmp/v/{name}" if address is None else address
    return WorkerRecord(role=role, address=address, incarnation=incarnation, state=state, name=name, pid=pid)


def names(registry: Registry, role=Role.RENDER) -> list[str]:
    return [record.name for record in registry.lookup(Lookup(role=role)).workers]


def test_a_registered_process_is_found_by_role(registry):
    registry.register(Register(worker=worker()))
    registry.register(Register(worker=worker("perception-0", "b", Role.PERCEPTION)))
    assert registry.lookup(Lookup(role=Role.RENDER)).workers == (worker(),)
    assert names(registry, Role.PERCEPTION) == ["perception-0"]
    assert names(registry, Role.AGENT) == []


def test_a_later_word_takes_the_place_of_an_earlier_one(registry):
    registry.register(Register(worker=worker(state=State.STARTING)))
    registry.register(Register(worker=worker(state=State.BUSY)))
    assert registry.lookup(Lookup(role=Role.RENDER)).workers == (worker(state=State.BUSY),)


def test_a_silent_process_is_not_listed(registry, clock):
    registry.register(Register(worker=worker("render-0", "a")))
    clock.now += LIVENESS - 1
    registry.register(Register(worker=worker("render-1", "b")))
    clock.now += 1
    assert names(registry) == ["render-1"]


def test_of_two_incarnations_at_one_address_the_later_one_is_listed_whichever_spoke_last(registry):
    registry.register(Register(worker=worker(incarnation="earlier", pid=1)))
    registry.register(Register(worker=worker(incarnation="later", pid=2)))
    registry.register(Register(worker=worker(incarnation="earlier", pid=1)))
    assert [record.incarnation for record in registry.lookup(Lookup(role=Role.RENDER)).workers] == ["later"]


def test_a_process_is_heard_of_by_its_name_and_number(registry, clock):
    assert registry.heard("agent", 7) is None
    registry.register(Register(worker=worker("agent", role=Role.AGENT, pid=7, address="")))
    assert registry.heard("agent", 7) == clock.now
    assert registry.heard("agent", 8) is None


def test_a_process_that_has_ended_can_be_forgotten_at_once(registry):
    registry.register(Register(worker=worker("render-0", "a", pid=1)))
    registry.register(Register(worker=worker("render-0", "b", pid=2)))
    registry.forget("render-0", 2)
    assert [record.pid for record in registry.lookup(Lookup(role=Role.RENDER)).workers] == [1]


def test_agents_without_an_address_are_told_apart_by_name(registry):
    registry.register(Register(worker=worker("agent", "a", Role.AGENT, address="")))
    registry.register(Register(worker=worker("evaluation", "b", Role.AGENT, address="")))
    assert names(registry, Role.AGENT) == ["agent", "evaluation"]


def test_processes_of_the_registry_beyond_are_listed_after_our_own(clock):
    remote_workers = {Role.RENDER: (worker("render-9", "z", address="tcp://gpu-box:5601"),)}
    registry = Registry(LIVENESS, clock, lambda role: remote_workers.get(role, ()))
    registry.register(Register(worker=worker()))
    assert names(registry) == ["render-0", "render-9"]
    assert names(registry, Role.PERCEPTION) == []
    assert [record.name for record in registry.records()] == ["render-0"]


def test_a_member_registers_and_learns_of_others_over_the_wire(tmp_path_factory):
    address = f"ipc://{tmp_path_factory.mktemp('s')}/orchestrator"
    timeouts, registry = Timeouts(heartbeat=0.05), Registry(LIVENESS)
    learned = threading.Event()
    with (
        serve_registry(registry, address, timeouts),
        Registration(address, describe=worker, on_orphaned=lambda: None, timeouts=timeouts) as registration,
    ):
        for _ in range(200):
            if registration.lookup(Role.RENDER):
                break
            learned.wait(0.05)
        assert registration.lookup(Role.RENDER) == (worker(),)
        with Client(address, role=Role.AGENT, serves=Role.ORCHESTRATOR) as client:
            assert client.call(Lookup(role=Role.RENDER)).workers == (worker(),)


def test_a_client_that_asks_it_to_drain_does_not_end_it(tmp_path_factory):
    address = f"ipc://{tmp_path_factory.mktemp('s')}/orchestrator"
    registry, timeouts = Registry(LIVENESS), Timeouts()
    with serve_registry(registry, address, timeouts), Client(address, role=Role.AGENT) as client:
        client.call(Drain())
        client.call(Register(worker=worker()))
        assert names(registry) == ["render-0"]


def test_an_address_that_cant_be_served_is_told(tmp_path_factory):
    address = f"ipc://{tmp_path_factory.mktemp('s')}/orchestrator"
    registry, timeouts = Registry(LIVENESS), Timeouts()
    with (
        serve_registry(registry, address, timeouts),
        pytest.raises(AddressUnavailable, match="in use"),
        serve_registry(registry, address, timeouts),
    ):
        pass
