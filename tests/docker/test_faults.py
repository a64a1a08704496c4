"""A training whose containers are killed, frozen, cut off, slowed down, multiplied and replaced, in this order."""

import subprocess
import time
from collections.abc import Iterator

import psutil
import pytest

from tests.docker.recoveries import RECOVERIES
from tests.docker.stack import SERVICES, Stack
from tests.docker.under_fire import UnderFire
from tests.docker.waiting import wait

OUTAGE = 6.0
"""Seconds: longer than the 5 s after which a silent worker is taken for hung."""

SLOW = "20mbit"


class Faults(UnderFire):
    """The project, and what happens to it."""

    def __init__(self, stack: Stack) -> None:
        super().__init__(stack)
        self.stack = stack


@pytest.fixture(scope="module")
def training(images, control_run, tmp_path_factory) -> Iterator[Faults]:
    stack = Stack(images, "faults", tmp_path_factory.mktemp("faults") / "keys")
    stack.remove()
    started = time.monotonic()
    stack.compose("up", "--no-build", "--wait", timeout=300)
    RECOVERIES.note("up --wait, until the agent is ready", time.monotonic() - started)
    wait(lambda: stack.read_progress().step > 0, "the first step")
    yield Faults(stack)
    stack.remove()


@pytest.mark.parametrize("service", SERVICES)
def test_a_process_that_is_killed_is_started_again(training, service):
    stack, container = training.stack, training.stack.container(service)
    restarts = stack.restarts(service)
    training.suffer(f"SIGKILL of {service}'s process", lambda: stack.process(service).kill())
    assert stack.container(service) == container
    assert stack.restarts(service) == restarts + 1
    wait(lambda: stack.health(service) == "healthy", f"health of {service}")


def test_the_agents_child_that_is_killed_is_started_again_within_its_container(training):
    stack = training.stack
    restarts = stack.restarts("agent")
    child = stack.process("agent").children()[0]
    training.suffer("SIGKILL of the agent below its orchestrator", child.kill)
    assert stack.restarts("agent") == restarts
    assert not psutil.pid_exists(child.pid) or stack.process("agent").children()[0].pid != child.pid


@pytest.mark.parametrize("service", SERVICES)
def test_a_container_may_be_frozen_for_a_while(training, service):
    stack, container = training.stack, training.stack.container(service)

    def freeze() -> None:
        stack.engine.docker("pause", container)
        time.sleep(OUTAGE)
        stack.engine.docker("unpause", container)

    training.suffer(f"pause of {service} for {OUTAGE:g} s, then unpause", freeze)


@pytest.mark.parametrize("service", SERVICES)
def test_a_container_may_lose_its_network_for_a_while(training, service):
    stack, container, network = training.stack, training.stack.container(service), f"{training.stack.name}_default"

    def cut_off() -> None:
        stack.engine.docker("network", "disconnect", network, container)
        time.sleep(OUTAGE)
        stack.engine.docker("network", "connect", "--alias", service, network, container)

    training.suffer(f"network of {service} off for {OUTAGE:g} s, then on", cut_off)


def test_training_goes_on_over_a_slow_network(training):
    """Of the renderer, whose frames are nearly all that crosses it."""
    stack = training.stack
    pid = stack.engine.inspect(stack.container("render"), "{{.State.Pid}}")
    device = network_device(pid)
    limit = ("root", "tbf", "rate", SLOW, "burst", "64kb", "latency", "400ms")
    training.suffer(
        f"render's network at {SLOW[:-4]} Mbit/s, first steps under it",
        lambda: within(pid, "tc", "qdisc", "add", "dev", device, *limit),
    )
    within(pid, "tc", "qdisc", "del", "dev", device, "root")


def test_render_workers_come_and_go_by_scale(training):
    stack = training.stack
    training.suffer(
        "--scale render=3, all ready and in use",
        lambda: (stack.scale("render", 3), wait(lambda: stack.renderers_at_work() == 3, "three renderers at work")),
    )
    training.suffer("--scale render=1", lambda: stack.scale("render", 1))
    wait(lambda: stack.renderers_at_work() == 1, "one renderer at work")


@pytest.mark.parametrize("service", SERVICES)
def test_a_rolling_restart_replaces_every_container(training, service):
    stack, container = training.stack, training.stack.container(service)
    replace = ("up", "--detach", "--no-build", "--no-deps", "--force-recreate", service)
    training.suffer(f"{service}'s container replaced", lambda: stack.compose(*replace))
    assert stack.container(service) != container
    wait(lambda: stack.health(service) == "healthy", f"health of {service}")


def test_in_the_end_all_is_as_if_nothing_had_happened(training, control_run):
    stack = training.stack
    wait(lambda: stack.exit_codes() == dict.fromkeys(SERVICES, 0), "the end of all with exit code 0", 600)
    training.compare(control_run.run)


def network_device(pid: str) -> str:
    """What the network of a container's process is called in there: eth0, and eth1 once it was off and on."""
    links = within(pid, "ip", "-oneline", "link", "show", "type", "veth")
    return links.split(":")[1].strip().split("@")[0]


def within(pid: str, *command: str) -> str:
    """Run one of this machine's programs in the network of a container's process."""
    done = subprocess.run(["nsenter", "--target", pid, "--net", *command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout
