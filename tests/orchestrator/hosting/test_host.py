import logging

import pytest

from orchestrator.hosting.host import GOODBYE, HostMonitor, HostOrder, HostTable, host
from orchestrator.hosting.joined_runs import JoinedRuns
from orchestrator.monitoring.live_display import Snapshot
from orchestrator.supervision.registry import Registry, serve_registry
from protocol.client.client import Client
from protocol.errors import AddressUnavailable, NotPermitted
from protocol.messages import Dismiss, Lookup, Register, Role, State, WorkerRecord
from protocol.security import Security, load_credentials
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts
from tests.protocol.security.deployment import Deployment, free_port

LIVENESS, GRACE = 5.0, 60.0


class Site:
    """A host's table with a clock of its own, and what is shown of it."""

    def __init__(self, *, stay: bool = False) -> None:
        self.now = 100.0
        self.shown: list[Snapshot] = []
        runs = JoinedRuns(LIVENESS, GRACE, self.clock)
        self.table = HostTable(Registry(LIVENESS, self.clock), runs, stay=stay)
        self.monitor = HostMonitor(self.table, "host at tcp://host:5600", self, LIVENESS, self.clock)

    def clock(self) -> float:
        return self.now

    def show(self, snapshot: Snapshot) -> None:
        self.shown.append(snapshot)

    def beat(self, name: str, role: Role = Role.RENDER) -> bool:
        """Whether the process is told that all is over."""
        address = "" if role is Role.AGENT else f"tcp://{name}:5601"
        record = WorkerRecord(role=role, address=address, incarnation=name, state=State.READY, name=name)
        return self.table.register(Register(worker=record)).over

    def ends(self, seconds: float = 1.0) -> bool:
        """Whether the host is to end, a while later."""
        self.now += seconds
        return self.monitor.poll()


def test_workers_are_told_once_the_run_is_done_and_the_run_itself_is_not():
    site = Site()
    assert not site.beat("gpu-box")
    assert not site.beat("monday", Role.AGENT)
    site.table.dismiss(Dismiss(incarnation="monday"))
    assert site.beat("gpu-box")
    assert site.beat("jetson", Role.PERCEPTION)
    assert not site.beat("monday", Role.AGENT)


def test_a_host_that_stays_tells_nobody_to_end():
    site = Site(stay=True)
    site.table.dismiss(Dismiss(incarnation="monday"))
    assert not site.beat("gpu-box")
    assert not site.ends(2 * GOODBYE)


def test_while_another_run_is_under_way_the_workers_go_on():
    site = Site()
    site.beat("monday", Role.AGENT)
    site.beat("tuesday", Role.AGENT)
    site.table.dismiss(Dismiss(incarnation="monday"))
    assert not site.beat("gpu-box")
    site.table.dismiss(Dismiss(incarnation="tuesday"))
    assert site.beat("gpu-box")


def test_the_host_ends_when_its_workers_have_fallen_silent(caplog):
    caplog.set_level(logging.INFO)
    site = Site()
    site.beat("gpu-box")
    site.table.dismiss(Dismiss(incarnation="monday"))
    assert not site.ends()
    assert site.shown[-1].activity == "all runs are done; waiting for the end of gpu-box"
    assert not site.ends(LIVENESS - 2)
    assert site.ends(1)
    assert "no worker is left; ending" in caplog.text


def test_a_host_that_was_started_again_right_then_waits_for_the_workers_to_hear_of_it():
    site = Site()
    site.table.dismiss(Dismiss(incarnation="monday"))
    assert not site.ends()
    assert site.beat("gpu-box")
    assert not site.ends(LIVENESS - 1)
    assert site.ends(1)


def test_a_worker_that_does_not_end_is_named_and_left(caplog):
    site = Site()
    site.table.dismiss(Dismiss(incarnation="monday"))
    ended = False
    while not ended:
        site.beat("old-worker")
        ended = site.ends()
    assert 100 + GOODBYE <= site.now <= 102 + GOODBYE
    assert "old-worker did not end within 30 s; ending without waiting for it" in caplog.text


def test_who_is_there_is_shown():
    site = Site()
    site.beat("gpu-box")
    site.beat("monday", Role.AGENT)
    assert not site.ends()
    assert [(one.name, one.state) for one in site.shown[-1].workers] == [("gpu-box", "ready"), ("monday", "running")]


def run_host(bind: str, security: Security | None = None) -> None:
    """One that ends at its first look."""
    stop = StopRequest()
    stop.ask()
    host(HostOrder(bind=bind, security=security or Security()), display=Site(), stop=stop)


def test_two_hosts_on_one_address_are_one_too_many():
    bind = f"tcp://127.0.0.1:{free_port()}"
    with (
        serve_registry(Registry(LIVENESS), bind, Timeouts()),
        pytest.raises(AddressUnavailable, match=f"{bind} is in use; stop the process that serves there"),
    ):
        run_host(bind)


def test_a_host_that_was_stopped_leaves_its_address_free():
    bind = f"tcp://127.0.0.1:{free_port()}"
    run_host(bind)
    run_host(bind)


def test_a_public_address_without_keys_is_refused():
    with pytest.raises(NotPermitted, match="keys new"):
        run_host("tcp://0.0.0.0:5600")


def test_a_key_of_another_role_makes_no_host(tmp_path):
    keys = Deployment(tmp_path)
    with pytest.raises(NotPermitted, match="'agent' is of the role agent"):
        run_host(f"tcp://127.0.0.1:{free_port()}", keys.security("agent"))


def test_who_registers_under_a_key_is_found_there_by_who_has_one(tmp_path):
    keys, bind = Deployment(tmp_path), f"tcp://127.0.0.1:{free_port()}"
    site = Site()
    with serve_registry(site.table, bind, Timeouts(), security=keys.security("orchestrator")):
        record = WorkerRecord(role=Role.RENDER, address="tcp://gpu-box:5601", incarnation="a", state=State.READY)
        with Client(bind, role=Role.RENDER, serves=Role.ORCHESTRATOR, security=keys.security("render")) as client:
            client.call(Register(worker=record))
        security = Security(load_credentials(tmp_path / "agent.key"))
        with Client(bind, role=Role.AGENT, serves=Role.ORCHESTRATOR, security=security) as client:
            assert client.call(Lookup(role=Role.RENDER)).workers == (record,)
            client.call(Dismiss(incarnation="monday"))
    assert site.table.is_over()
