"""A run is asked over HTTP how it is."""

import json

import pytest
from prometheus_client import CollectorRegistry, generate_latest

from orchestrator.monitoring.live_display import Snapshot
from orchestrator.monitoring.metrics import RunCollector
from orchestrator.monitoring.telemetry import STALE, Monitors, ObservedRun, host_telemetry, run_telemetry
from orchestrator.supervision.heartbeat import Health
from orchestrator.supervision.registry import Registry, serve_registry
from protocol.errors import AddressUnavailable
from protocol.messages import Role
from protocol.observer import NO_OBSERVER
from protocol.telemetry.info import About
from protocol.timeouts import Timeouts
from tests.protocol.security.deployment import free_port
from tests.protocol.telemetry.monitors import free_endpoint, monitoring


def health(name: str, role: Role, state: str, restarts: int = 0) -> Health:
    return Health(name=name, role=role, pid=1, state=state, restarts=restarts)


def snapshot(*workers: Health) -> Snapshot:
    return Snapshot(activity="training", elapsed=1.0, workers=workers)


RENDER = health("render-0", Role.RENDER, "busy")
PERCEPTION = health("perception-0", Role.PERCEPTION, "ready")
AGENT = health("agent", Role.AGENT, "running")


class Shown:
    def __init__(self) -> None:
        self.snapshots = []

    def show(self, snapshot: Snapshot) -> None:
        self.snapshots.append(snapshot)


@pytest.fixture
def now() -> list[float]:
    return [100.0]


@pytest.fixture
def run(now) -> ObservedRun:
    return ObservedRun(About(role=Role.ORCHESTRATOR, name="monday"), Shown(), lambda: now[0])


def waits(run: ObservedRun) -> list[tuple[str, str]]:
    return [(wait.on, wait.reason) for wait in run.waits()]


def test_before_anything_was_started_it_waits_for_that(run):
    assert [on for on, _ in waits(run)] == ["start"]


def test_one_at_work_of_each_role_is_enough(run):
    run.show(snapshot(RENDER, health("render-1", Role.RENDER, "not running"), PERCEPTION, AGENT))
    assert waits(run) == []


@pytest.mark.parametrize("state", ["starting", "draining", "silent", "not running"])
def test_a_role_of_which_none_is_at_work_is_named(run, state):
    run.show(snapshot(health("render-0", Role.RENDER, state), PERCEPTION, AGENT))
    assert waits(run) == [("render", f"render-0: {state}")]


def test_an_agent_is_needed_as_well(run):
    run.show(snapshot(RENDER, PERCEPTION))
    assert waits(run) == [("agent", "none is known")]


def test_what_was_seen_long_ago_does_not_count(run, now):
    run.show(snapshot(RENDER, PERCEPTION, AGENT))
    now[0] += STALE + 1
    assert [on for on, _ in waits(run)] == ["look"]
    run.show(snapshot(RENDER, PERCEPTION, AGENT))
    assert waits(run) == []


def test_restarts_and_processes_are_told_by_name_and_role():
    registry, seen = CollectorRegistry(), [None]
    registry.register(RunCollector(lambda: seen[0]))
    assert registry.get_sample_value("vantage_restarts_total", {"process": "agent"}) is None
    seen[0] = snapshot(RENDER, health("render-1", Role.RENDER, "silent", restarts=3), AGENT)
    assert registry.get_sample_value("vantage_restarts_total", {"process": "render-1"}) == 3
    assert registry.get_sample_value("vantage_restarts_total", {"process": "agent"}) == 0
    for at_work in ("true", "false"):
        assert registry.get_sample_value("vantage_processes", {"role": "render", "at_work": at_work}) == 1


def test_workers_of_one_name_on_several_machines_are_told_once():
    registry = CollectorRegistry()
    registry.register(RunCollector(lambda: snapshot(RENDER, RENDER, PERCEPTION, AGENT)))
    told = generate_latest(registry).decode()
    assert told.count('vantage_restarts_total{process="render-0"}') == 1
    assert 'vantage_processes{at_work="true",role="render"} 2.0' in told


def test_without_a_port_the_display_is_as_it_was():
    display = Shown()
    with run_telemetry(None, "monday", display) as monitors:
        assert (monitors.display, monitors.registry) == (display, NO_OBSERVER)


def test_with_one_the_display_is_shown_the_same_and_monitors_are_answered():
    display, at = Shown(), free_endpoint()
    with run_telemetry(at, "monday", display) as monitors, monitoring(at) as monitor:
        assert isinstance(monitors, Monitors)
        assert not monitor.is_ready()
        monitors.display.show(snapshot(RENDER, PERCEPTION, AGENT))
        assert monitor.is_ready()
        told = monitor.json("/info")
        with pytest.raises(AddressUnavailable), run_telemetry(at, "tuesday", display):
            pass
    assert len(display.snapshots) == 1
    assert (told["role"], told["name"]) == ("orchestrator", "monday")


@pytest.mark.slow
def test_a_host_is_ready_as_soon_as_it_serves_and_tells_who_is_there(wait_until):
    display, at, bind = Shown(), free_endpoint(), f"tcp://127.0.0.1:{free_port()}"
    with host_telemetry(at, bind, display) as monitors, monitoring(at) as monitor:
        assert monitor.waits_on() == {"start"}
        with serve_registry(Registry(5.0), bind, Timeouts(), monitors.registry):
            # Its address is bound a moment before it serves.
            wait_until(monitor.is_ready)
            monitors.display.show(snapshot(RENDER, PERCEPTION))
            assert monitor.metric("vantage_processes", role="render", at_work="true") == 1
            assert monitor.metric("vantage_processes", role="agent", at_work="true") == 0
        told = monitor.json("/info")
    assert len(display.snapshots) == 1
    assert (told["role"], told["name"], told["serves"]) == ("orchestrator", "host", [bind])


@pytest.mark.parametrize("command", ["train nothing.toml", "resume nothing"])
def test_a_port_that_is_none_is_told(orchestrator, command):
    (orchestrator.folder / "nothing.toml").write_text("")
    (orchestrator.folder / "nothing").mkdir()
    (orchestrator.folder / "nothing" / "config.toml").write_text("")
    done = orchestrator.run(*command.split(), "--http", "somewhere")
    assert done.returncode == 2
    assert "'somewhere' is not an HTTP endpoint" in done.stderr


@pytest.mark.slow
def test_a_run_tells_of_itself_while_it_trains(orchestrator, wait_until):
    config = "[training]\nsteps = 400\n[evaluation]\nepisodes = 1\nbaselines = ['stay']\n"
    (orchestrator.folder / "short.toml").write_text(config)
    at = free_endpoint()
    child = orchestrator.start("train", "short.toml", "--run", "one", "--json", "--http", str(at.port))
    with monitoring(at) as monitor:
        wait_until(lambda: monitor.is_ready() or child.poll() is not None)
        assert monitor.get("/health/live").status_code == 200
        assert monitor.json("/info")["name"] == "one"
        assert monitor.metric("vantage_restarts_total", process="render-0") == 0
        registered = {"type": "Register", "outcome": "answered", "code": ""}
        wait_until(lambda: monitor.metric("vantage_requests_total", **registered))
    out, err = child.communicate(timeout=60)
    assert child.returncode == 0, err
    assert json.loads(out)["interrupted"] is False
