"""Each fault's four parts, played on plain processes: what restarts them in a run is left out, and done by the test."""

import os
import resource
import signal
import subprocess
import sys

import psutil
import pytest

from orchestrator.chaos.errors import InvariantBroken, NotRecovered
from orchestrator.chaos.scenarios.catalogue import OF_WORKERS, catalogue, chosen
from orchestrator.chaos.scenarios.checkpoint_kills import PLACES, KillAtCheckpoint
from orchestrator.chaos.scenarios.full_disk import FullDisk, limit_files
from orchestrator.chaos.scenarios.kills import KillProcess
from orchestrator.chaos.scenarios.late_replies import LateReply
from orchestrator.chaos.scenarios.orders import carried_out
from orchestrator.chaos.scenarios.quick_restart import RestartWithinAPing
from orchestrator.chaos.scenarios.stops import StopProcess
from orchestrator.supervision.heartbeat import is_alive
from protocol.config import TimeoutsConfig
from protocol.errors import InvalidInput
from protocol.messages import Role

HURT = [Role.RENDER, Role.PERCEPTION, Role.AGENT]
NAMES = {Role.RENDER: "render-0", Role.PERCEPTION: "perception-0", Role.AGENT: "agent"}


@pytest.fixture
def children(start):
    return {role: start(name, role) for role, name in NAMES.items()}


@pytest.mark.parametrize("role", HURT)
def test_a_killed_process_is_missed_until_another_has_its_name(rehearsed, start, children, role):
    scenario = KillProcess(role, 0.5)
    scenario.setup(rehearsed)
    scenario.fault(rehearsed)
    rehearsed.wait(lambda: not is_alive(children[role]), "it was dead")
    assert not scenario.recovered(rehearsed)
    start(NAMES[role], role)
    assert scenario.recovered(rehearsed)
    scenario.invariant(rehearsed)


def test_a_death_that_takes_another_with_it_breaks_the_invariant(rehearsed, children):
    scenario = KillProcess(Role.RENDER, 0.5)
    scenario.setup(rehearsed)
    scenario.fault(rehearsed)
    os.kill(children[Role.AGENT].pid, signal.SIGKILL)
    rehearsed.wait(lambda: not is_alive(children[Role.AGENT]), "it was dead")
    with pytest.raises(InvariantBroken, match="agent did not survive the death of render-0"):
        scenario.invariant(rehearsed)


@pytest.mark.parametrize("role", HURT)
def test_a_stopped_process_stays_until_it_is_replaced_and_must_be_gone_then(rehearsed, start, children, role):
    scenario = StopProcess(role, 0.5)
    scenario.setup(rehearsed)
    scenario.fault(rehearsed)
    stopped = psutil.Process(children[role].pid)
    rehearsed.wait(lambda: stopped.status() == psutil.STATUS_STOPPED, "it was stopped")
    assert not scenario.recovered(rehearsed)
    start(NAMES[role], role)
    assert scenario.recovered(rehearsed)
    with pytest.raises(InvariantBroken, match="still runs"):
        scenario.invariant(rehearsed)
    stopped.kill()
    rehearsed.wait(lambda: not is_alive(children[role]), "it was dead")
    scenario.invariant(rehearsed)


def test_chance_chooses_among_the_workers_of_a_role(rehearsed, start):
    workers = [start(f"render-{number}", Role.RENDER) for number in range(3)]
    assert [rehearsed.member(Role.RENDER, chance) for chance in (0.0, 0.5, 0.99)] == workers


def test_a_worker_that_is_replaced_within_a_ping_is_quick_enough(rehearsed, start_worker, start):
    start("agent", Role.AGENT)
    first = start_worker()
    scenario = RestartWithinAPing(Role.RENDER, 0.0)
    rehearsed.timeouts = TimeoutsConfig(heartbeat=300.0)
    scenario.setup(rehearsed)
    poll, restarted = rehearsed.poll, []

    def poll_and_restart():
        poll()
        if not restarted and not is_alive(first):
            restarted.append(start_worker())

    rehearsed.poll = poll_and_restart
    scenario.fault(rehearsed)
    assert restarted
    scenario.invariant(rehearsed)
    rehearsed.timeouts = TimeoutsConfig(heartbeat=1e-6)
    with pytest.raises(InvariantBroken, match="within a ping interval"):
        scenario.invariant(rehearsed)


WRITER = """
import sys, time
from pathlib import Path
from protocol.failpoint import Failpoints
said, points = Path(sys.argv[1]), Failpoints(Path(sys.argv[2]))
while True:
    points.reach("checkpoint-opened")
    try:
        with said.with_name("data").open("ab") as data:
            data.write(b"x")
        word = "ok"
    except OSError as error:
        word = error.strerror
    said.with_name(word).mkdir(exist_ok=True)
    time.sleep(0.01)
"""


@pytest.fixture
def writer(start, rehearsed, tmp_path):
    """An agent that writes on and on, and shows by the names of folders what became of it."""
    folder = tmp_path / "written"
    folder.mkdir()
    start(
        "agent",
        Role.AGENT,
        command=(sys.executable, "-c", WRITER, str(folder / "x"), f"{rehearsed.directory.path}.failpoints"),
    )
    return lambda: {path.name for path in folder.iterdir()} - {"data"}


@pytest.mark.slow
def test_a_full_disk_fails_every_write_of_the_agent_and_ends(rehearsed, writer):
    rehearsed.wait(lambda: writer() == {"ok"}, "it wrote")
    scenario = FullDisk(0.0)
    scenario.setup(rehearsed)
    scenario.fault(rehearsed)
    assert writer() == {"ok", "File too large"}
    [agent] = rehearsed.children.alive(Role.AGENT)
    assert resource.prlimit(agent.pid, resource.RLIMIT_FSIZE)[0] == resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    scenario.invariant(rehearsed)


def test_a_process_that_is_gone_can_not_be_limited_and_is_left_alone():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait(30)
    assert limit_files(child.pid, 0) == (resource.RLIM_INFINITY, resource.RLIM_INFINITY)


REACHER = """
import os, sys, time
from protocol.failpoint import Failpoints
from pathlib import Path
points = Failpoints(Path(sys.argv[1]))
while True:
    points.reach(sys.argv[2])
    time.sleep(0.01)
"""


@pytest.fixture
def reacher(start, rehearsed):
    """A process that comes to a failpoint again and again."""

    def reacher(name, role, place):
        folder = f"{rehearsed.directory.path}.failpoints"
        return start(name, role, command=(sys.executable, "-c", REACHER, folder, place))

    return reacher


@pytest.mark.parametrize("place", PLACES)
def test_an_agent_dies_at_each_place_of_a_checkpoint(rehearsed, reacher, place):
    agent = reacher("agent", Role.AGENT, place)
    scenario = KillAtCheckpoint(place)
    scenario.setup(rehearsed)
    scenario.fault(rehearsed)
    rehearsed.wait(lambda: not is_alive(agent), "it was dead")
    assert not scenario.recovered(rehearsed)
    reacher("agent", Role.AGENT, place)
    assert scenario.recovered(rehearsed)
    scenario.invariant(rehearsed)
    assert is_alive(rehearsed.children.alive(Role.AGENT)[0])


def test_a_checkpoint_without_a_manifest_breaks_the_invariant(rehearsed):
    (rehearsed.directory.path / "checkpoints" / "step-000000010").mkdir(parents=True)
    with pytest.raises(InvariantBroken, match="step-000000010 has a checkpoint's name and no manifest"):
        KillAtCheckpoint(PLACES[0]).invariant(rehearsed)


def test_a_late_reply_is_held_back_and_its_worker_must_live(rehearsed, reacher):
    worker = reacher("render-0", Role.RENDER, "reply-render")
    scenario = LateReply(Role.RENDER)
    scenario.setup(rehearsed)
    scenario.fault(rehearsed)
    scenario.invariant(rehearsed)
    os.kill(worker.pid, signal.SIGKILL)
    rehearsed.wait(lambda: not is_alive(worker), "it was dead")
    with pytest.raises(InvariantBroken, match="render-0 did not survive a late reply"):
        scenario.invariant(rehearsed)


def test_a_fault_that_waits_for_the_training_is_ordered_before_the_training_goes_on(rehearsed, children):
    ordered = (
        (KillAtCheckpoint("checkpoint-written"), "checkpoint-written"),
        (LateReply(Role.RENDER), "reply-render"),
        (FullDisk(0.0), "checkpoint-opened"),
    )
    for scenario, place in ordered:
        scenario.setup(rehearsed)
        assert rehearsed.failpoints.is_pending(place)
    assert resource.prlimit(children[Role.AGENT].pid, resource.RLIMIT_FSIZE)[0] == 0


def test_an_order_that_is_never_carried_out_is_taken_back(rehearsed, monkeypatch):
    monkeypatch.setattr(type(rehearsed), "wait", _gives_up)
    rehearsed.failpoints.order("nowhere", "kill")
    with pytest.raises(NotRecovered):
        carried_out(rehearsed, "nowhere")
    assert not rehearsed.failpoints.is_pending("nowhere")


def _gives_up(run, until, what):
    assert run.failpoints.is_pending("nowhere")
    raise NotRecovered(what)


def test_a_class_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(InvalidInput, match="there is no fault class 'kill-cat'; there are kill-render, "):
        chosen(("kill-cat",))


def test_those_named_are_chosen_and_all_without_a_name():
    assert list(chosen(("garbage", "kill-agent"))) == ["garbage", "kill-agent"]
    assert chosen(()).keys() == catalogue().keys()
    assert len(catalogue()) == 20


def test_a_run_without_workers_has_the_other_faults() -> None:
    faults = catalogue(workers=False)
    assert {"kill-agent", "stop-agent", "kill-orchestrator", "garbage", "full-disk"} <= faults.keys()
    assert catalogue().keys() >= OF_WORKERS
    assert faults.keys() == catalogue().keys() - OF_WORKERS
    with pytest.raises(InvalidInput, match="kill-render"):
        chosen(("kill-render",), workers=False)
