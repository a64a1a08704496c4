"""A run and its host, in one process: what is waited for, what is learned, how the end is told."""

import os
from collections.abc import Callable, Generator
from contextlib import contextmanager

import pytest

from orchestrator.errors import HostLost, HostNotTold
from orchestrator.hosting.host import HostTable
from orchestrator.hosting.joined_runs import JoinedRuns
from orchestrator.hosting.joining import Join, JoinedHost, NameLookup, dismiss, join_of
from orchestrator.supervision.registry import Registry, serve_registry
from protocol.errors import AddressUnavailable, InvalidInput, NotPermitted
from protocol.messages import Register, Role, State, WorkerRecord
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts
from tests.protocol.security.deployment import Deployment, free_port

QUICK = Timeouts(heartbeat=0.02, liveness=0.2, grace=0.3)


class Hub:
    """A host that comes and goes."""

    def __init__(self, address: str) -> None:
        self.join = Join(address=address)
        self.table = HostTable(Registry(60.0), JoinedRuns(60.0, 60.0))

    @contextmanager
    def open(self) -> Generator[None]:
        with serve_registry(self.table, self.join.address, QUICK):
            yield

    def enter(self, name: str, role: Role, state: State = State.READY) -> WorkerRecord:
        record = WorkerRecord(role=role, address=f"tcp://{name}:1", incarnation=name, state=state, name=name)
        self.table.register(Register(worker=record))
        return record


@pytest.fixture
def hub(tmp_path_factory) -> Hub:
    return Hub(f"ipc://{tmp_path_factory.mktemp('s')}/host")


def test_what_is_waited_for_is_said_until_nobody_is_missing(hub, wait_until):
    with JoinedHost(hub.join, "monday", QUICK) as host:
        assert host.waits_for() == f"a host at {hub.join.address} (nobody answers there: does 'orchestrator host' run?)"
        with hub.open():
            both = f"a render worker and a perception worker to be ready, at the host {hub.join.address}"
            wait_until(lambda: host.waits_for() == both)
            hub.enter("gpu-box", Role.RENDER)
            one = f"a perception worker to be ready, at the host {hub.join.address}"
            wait_until(lambda: host.waits_for() == one)
            hub.enter("jetson", Role.PERCEPTION, State.STARTING)
            wait_until(lambda: len(host.lookup(Role.PERCEPTION)) == 1)
            assert host.lacks(Role.PERCEPTION)
            hub.enter("jetson", Role.PERCEPTION, State.BUSY)
            wait_until(lambda: host.waits_for() is None)


def test_a_run_is_registered_under_its_name_and_told_of_workers_alone(hub, wait_until):
    with hub.open(), JoinedHost(hub.join, "monday", QUICK) as host:
        renderer = hub.enter("gpu-box", Role.RENDER)
        wait_until(lambda: host.lookup(Role.RENDER) == (renderer,))
        wait_until(lambda: "monday" in [record.name for record in hub.table.records()])
        assert host.lookup(Role.AGENT) == ()
        assert [(one.name, one.state) for one in host.health()] == [("gpu-box", "ready")]


@pytest.mark.slow
def test_a_host_that_is_away_for_a_moment_is_not_missed_and_one_that_stays_away_is(hub, wait_until):
    with JoinedHost(hub.join, "monday", QUICK) as host:
        for _ in range(2):
            with hub.open():
                wait_until(lambda: host.waits_for() is not None and "to be ready" in host.waits_for())
                host.check()
        wait_until(lambda: lost(host.check))
        with pytest.raises(HostLost, match=r"is gone for 0.3 s \(timeouts.grace\), and without one its workers end"):
            host.check()


def lost(check: Callable[[], None]) -> bool:
    try:
        check()
    except HostLost:
        return True
    return False


def test_a_key_that_the_host_does_not_take_ends_the_wait_at_once(tmp_path, wait_until):
    keys, address = Deployment(tmp_path), f"tcp://127.0.0.1:{free_port()}"
    join = Join(address=address, security=keys.security("agent"))
    keys.revoke("agent")
    with (
        serve_registry(Registry(60.0), address, QUICK, security=keys.security("orchestrator")),
        JoinedHost(join, "monday", QUICK) as host,
        pytest.raises(NotPermitted, match="does not take our key 'agent'"),
    ):
        wait_until(lambda: host.waits_for() is None)


def test_a_name_that_means_no_machine_is_told(wait_until):
    lookup = NameLookup("no-such-machine.invalid")
    wait_until(lambda: "the name 'no-such-machine.invalid' is unknown here" in lookup.trouble())
    known = NameLookup("localhost")
    assert known.trouble() == ""


def test_the_end_of_a_run_is_told(hub):
    with hub.open():
        dismiss(hub.join, QUICK, lambda _: None, StopRequest())
        assert hub.table.is_over()


@pytest.mark.slow
def test_a_host_that_was_killed_right_then_is_told_when_it_is_back(hub):
    shown = []

    class Killed:
        """Starts the host while it is already being told."""

        opened = None

        def __call__(self, activity: str) -> None:
            shown.append(activity)
            if len(shown) == 3:
                self.opened = hub.open()
                self.opened.__enter__()

    killed = Killed()
    dismiss(hub.join, Timeouts(heartbeat=0.02, grace=30.0), killed, StopRequest())
    assert hub.table.is_over()
    killed.opened.__exit__(None, None, None)
    assert set(shown) == {f"telling the host at {hub.join.address} that the run is done"}


def test_a_host_that_does_not_come_back_is_not_told_for_ever(hub):
    with pytest.raises(HostNotTold, match=r"its workers stay: .* did not answer Dismiss within 0\.3 s"):
        dismiss(hub.join, QUICK, lambda _: None, StopRequest())


def test_a_request_to_stop_ends_the_telling(hub):
    stop = StopRequest()
    stop.ask()
    with pytest.raises(HostNotTold, match="stopped on request"):
        dismiss(hub.join, Timeouts(), lambda _: None, stop)


def test_an_orchestrator_that_is_no_host_says_so(hub):
    with (
        serve_registry(Registry(60.0), hub.join.address, QUICK),
        pytest.raises(HostNotTold, match="does not answer Dismiss"),
    ):
        dismiss(hub.join, QUICK, lambda _: None, StopRequest())


def joined(address: str | None = "tcp://hub:5600", key=None, allowed=None, insecure=False, environment=None):
    return join_of(address, key, allowed, insecure=insecure, environment=environment or {})


def test_without_a_host_there_is_nothing_to_join_and_no_key_has_a_meaning(tmp_path):
    assert joined(None) is None
    assert joined(None, environment={"VANTAGE_KEY": "/nowhere"}) is None
    for options in ({"key": tmp_path / "a.key"}, {"allowed": tmp_path / "a.json"}, {"insecure": True}):
        with pytest.raises(InvalidInput, match="they need --join"):
            joined(None, **options)


def test_the_agent_is_given_the_same_key_wherever_it_was_named(tmp_path, monkeypatch):
    keys = Deployment(tmp_path)
    monkeypatch.chdir(tmp_path)
    named = joined(key=type(tmp_path)("agent.key"))
    assert named.options == ("--key", str(tmp_path / "agent.key"))
    by_environment = joined(environment={"VANTAGE_KEY": str(tmp_path / "agent.key")})
    assert by_environment.options == named.options
    assert by_environment.security.credentials.own.public == keys.public("agent")
    assert joined(insecure=True, environment={"VANTAGE_KEY": "/nowhere"}).options == ("--insecure",)
    assert joined("tcp://127.0.0.1:5600").options == ()


def test_a_key_of_another_role_a_missing_one_and_an_open_network_are_refused(tmp_path):
    Deployment(tmp_path)
    with pytest.raises(
        NotPermitted, match="'render' is of the role render, and this process needs one of the role agent"
    ):
        joined(key=tmp_path / "render.key")
    with pytest.raises(NotPermitted, match=r"nobody\.key"):
        joined(key=tmp_path / "nobody.key")
    with pytest.raises(NotPermitted, match="there is no key: make one"):
        joined()
    with pytest.raises(AddressUnavailable):
        joined("hub")


def test_what_is_registered_is_this_process(hub, wait_until):
    with hub.open(), JoinedHost(hub.join, "monday", QUICK):
        wait_until(lambda: bool(hub.table.records()))
        (record,) = hub.table.records()
    assert (record.role, record.address, record.pid) == (Role.AGENT, "", os.getpid())
    assert record.incarnation == hub.join.incarnation
