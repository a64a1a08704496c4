"""Render worker, perception worker and agent on three hosts with keys, and a stranger on a fourth.

Real processes in network namespaces: what is shown is what a machine on the same network could do.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from protocol.messages import Role
from tests.deployment.hosts import Hosts, why_not
from tests.protocol.security.deployment import Deployment

HERE = Path(__file__).parent
pytestmark = pytest.mark.slow


SHORT = "[environment]\nnum_envs = 2\n[training]\nsteps = 40\nprefill = 20\n[learner.sac]\nbatch_size = 16\n"


class ThreeHosts:
    """What runs where, and what it has written down."""

    def __init__(self, hosts: Hosts, folder: Path) -> None:
        self.hosts = hosts
        self.keys = Deployment(folder / "keys")
        self.logs = folder
        self.processes: dict[str, subprocess.Popen[str]] = {}
        at = hosts.addresses
        self.addresses = {
            "orchestrator": f"tcp://{at['trainer']}:5600",
            "render": f"tcp://{at['gpu-box']}:5601",
            "perception": f"tcp://{at['jetson']}:5602",
        }

    def start(self) -> None:
        self.start_host("--stay")
        registry = self.addresses["orchestrator"]
        for host, role in (("gpu-box", "render"), ("jetson", "perception")):
            bind = f"tcp://0.0.0.0:{self.addresses[role].rpartition(':')[2]}"
            options = ("--bind", bind, "--advertise", self.addresses[role], "--key", self._key(role))
            self._start(host, role, "-m", f"{role}_worker", *options, "--orchestrator", registry, "--name", host)

    def start_host(self, *options: str) -> None:
        """Have an orchestrator that starts nobody on the trainer."""
        address = ("--bind", self.addresses["orchestrator"], "--key", self._key("orchestrator"))
        self._start("trainer", "orchestrator", "-m", "orchestrator", "host", *address, *options)

    def end(self, name: str) -> int:
        """Wait for the end of a process; returns its exit code."""
        return self.processes[name].wait(120)

    def joints_seen(self, host: str, key: Path) -> int:
        """How many joints of a person an agent on a host sees through both workers."""
        program, registry = str(HERE / "look.py"), self.addresses["orchestrator"]
        return int(self.hosts.run(host, sys.executable, program, str(key), registry))

    def train(self, run: Path) -> None:
        """Have an agent train in a run directory, with the workers' addresses on its command line."""
        workers = ("--render", self.addresses["render"], "--perception", self.addresses["perception"])
        options = ("--key", self._key("agent"), "--run", str(run), *workers)
        self.hosts.run("trainer", sys.executable, "-m", "agent", "train", *options)

    def train_joined(self, config: Path, run: Path) -> None:
        """Have a training join the host, which alone knows where the workers are."""
        options = ("--join", self.addresses["orchestrator"], "--key", self._key("agent"), "--no-evaluate")
        train = ("-m", "orchestrator", "train", str(config), "--run", str(run), *options)
        self.hosts.run("trainer", sys.executable, *train)

    def log(self, role: str) -> str:
        return (self.logs / f"{role}.log").read_text()

    def _start(self, host: str, name: str, *command: str) -> None:
        log = self.logs / f"{name}.log"
        self.processes[name] = self.hosts.start(host, sys.executable, *command, log=log, environment={})

    def _key(self, name: str) -> str:
        return str(self.keys.folder / f"{name}.key")


@pytest.fixture(scope="module")
def three_hosts(tmp_path_factory) -> Iterator[ThreeHosts]:
    reason = why_not()
    if reason is not None:
        pytest.skip(f"NOT RUN: {reason}")
    hosts = Hosts(["gpu-box", "jetson", "trainer", "stranger"])
    try:
        deployment = ThreeHosts(hosts, tmp_path_factory.mktemp("deployment"))
        deployment.start()
        yield deployment
    finally:
        hosts.close()


def test_who_has_a_key_sees_a_person_across_hosts(three_hosts):
    assert three_hosts.joints_seen("trainer", three_hosts.keys.folder / "agent.key") > 10


@pytest.fixture(scope="module")
def here(tmp_path_factory) -> Path:
    """A training on this machine, and its configuration beside it."""
    folder = tmp_path_factory.mktemp("here")
    (folder / "short.toml").write_text(SHORT)
    train = ("-m", "orchestrator", "train", str(folder / "short.toml"), "--run", str(folder / "run"), "--no-evaluate")
    subprocess.run([sys.executable, *train], check=True, capture_output=True, timeout=240)
    return folder / "run"


def test_a_training_across_hosts_ends_as_one_on_this_machine(three_hosts, here, tmp_path):
    across = tmp_path / "across"
    across.mkdir()
    (across / "config.toml").write_bytes((here / "config.toml").read_bytes())
    three_hosts.train(across)
    _assert_same(here, across)
    # Also this is the same: frames were packed for their way, which on one machine they are not.
    assert "frames are asked for as lossless" in three_hosts.log("perception")


def test_a_stranger_is_answered_nothing_and_every_log_says_who_tried(three_hosts):
    keys = three_hosts.keys
    loot = keys.folder.parent / "loot"
    _steal(keys, loot)
    # Until it is revoked, the stolen key is as good there as anywhere: what follows hangs on the keys alone.
    assert three_hosts.joints_seen("stranger", loot / "stolen" / "revoked.key") > 10
    keys.revoke("revoked")
    targets = [f"{name}={address}" for name, address in three_hosts.addresses.items()]
    intruder = (sys.executable, str(HERE / "intruder.py"), str(loot), *targets)
    tried = json.loads(three_hosts.hosts.run("stranger", *intruder))
    assert len(tried) >= 50
    assert [one for one in tried if one["answered"]] == []
    stranger = three_hosts.hosts.addresses["stranger"]
    for role in ("render", "perception", "orchestrator"):
        log = three_hosts.log(role)
        assert f"refused {stranger}: its key 'revoked' was revoked" in log
        assert f"refused {stranger}: its key " in log
        assert "is not in the list of allowed keys" in log
        assert "before it had shown a valid key" in log
    assert "its key 'render' is of the role render, which may not call render" in three_hosts.log("render")
    assert "can't register a agent process" in three_hosts.log("orchestrator")
    assert three_hosts.joints_seen("trainer", keys.folder / "agent.key") > 10


def test_a_training_that_joins_the_host_ends_so_as_well_and_then_all_end(three_hosts, here, tmp_path):
    three_hosts.processes["orchestrator"].terminate()
    assert three_hosts.end("orchestrator") == 0
    three_hosts.start_host()
    across = tmp_path / "across"
    three_hosts.train_joined(here.parent / "short.toml", across)
    _assert_same(here, across)
    assert [three_hosts.end(role) for role in ("render", "perception", "orchestrator")] == [0, 0, 0]
    assert "the run is over" in three_hosts.log("render")


def _assert_same(here: Path, across: Path) -> None:
    for name in ("weights.safetensors", "episodes.jsonl"):
        assert (across / name).read_bytes() == (here / name).read_bytes()
    journals = {path.name: path.read_bytes() for path in (here / "replay").iterdir()}
    assert journals == {path.name: path.read_bytes() for path in (across / "replay").iterdir()}
    assert journals


def _steal(keys: Deployment, loot: Path) -> None:
    """Give the stranger keys that were lost and revoked, the keys of other roles, and the public ones of all."""
    keys.make("revoked", Role.AGENT)
    keys.copy_to(loot / "stolen", ("render", "perception", "revoked"))
    for role in Role:
        keys.make_up(f"made-up-{role}", role, loot / "made-up" / role)
