"""The stack on a swarm of one machine: placed by labels, restarted while the training goes on, to the same end."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from orchestrator.chaos.progress_log import ProgressLog
from tests.docker.engine import REPOSITORY, Engine
from tests.docker.stack import HERE, SERVICES, Stack
from tests.docker.under_fire import UnderFire
from tests.docker.waiting import wait

ADDRESS = "10.84.0.1"
LABELS = ("gpu=true", "role=jetson", "runs=true")


class Swarm:
    """A stack that is deployed, with the short training in it."""

    def __init__(self, engine: Engine, keys: Path) -> None:
        self.engine = engine
        self.config = HERE / "short.toml"
        self._environment = {"VANTAGE_CONFIG": str(self.config), "VANTAGE_KEYS": str(keys), "VANTAGE_RUN": "short"}
        self._progress: ProgressLog | None = None

    def deploy(self) -> None:
        """Make the swarm, label its one node, and deploy."""
        self.engine.beside("ip", "link", "add", "swarm0", "type", "bridge")
        self.engine.beside("ip", "address", "add", f"{ADDRESS}/24", "dev", "swarm0")
        self.engine.beside("ip", "link", "set", "swarm0", "up")
        self.engine.docker("swarm", "init", "--advertise-addr", ADDRESS, "--listen-addr", ADDRESS)
        file = str(REPOSITORY / "docker" / "stack.yaml")
        self.engine.docker(
            "stack", "deploy", "--detach=true", "--compose-file", file, "swarm", environment=self._environment
        )

    def label(self) -> None:
        """Say that the node may do everything."""
        node = self.engine.docker("node", "ls", "--quiet")
        self.engine.docker("node", "update", *(word for label in LABELS for word in ("--label-add", label)), node)

    def remove(self) -> None:
        """Remove the stack, the swarm and the run.

        The wait is ours: `stack rm --detach=false` counts its own polls up to the number of tasks, and goes on for
        ever where that number sinks past the count (docker/cli#7304).
        """
        if self.engine.run("stack", "rm", "--detach=true", "swarm").returncode == 0:
            wait(lambda: not self._containers(), "the end of the stack's containers")
        self.engine.run("swarm", "leave", "--force")
        if left := self._containers():
            self.engine.run("rm", "--force", *left)
        self.engine.run("volume", "rm", "--force", "swarm_runs", "swarm_cache")

    def _containers(self) -> list[str]:
        stack = "label=com.docker.stack.namespace=swarm"
        return self.engine.docker("ps", "--all", "--quiet", "--filter", stack).split()

    def states(self) -> dict[str, str]:
        """In which state the newest task of each service is: its first word, such as `Running` or `Complete`."""
        shown = ("--format", "{{.CurrentState}}")
        tasks = {name: self.engine.docker("service", "ps", *shown, f"swarm_{name}") for name in SERVICES}
        return {name: lines.split()[0] for name, lines in tasks.items()}

    def update(self, service: str, *options: str) -> None:
        """Change a service, and wait until it has converged."""
        self.engine.docker("service", "update", "--detach=false", "--quiet", *options, f"swarm_{service}", timeout=300)

    def run_directory(self) -> Path:
        volume = self.engine.docker("volume", "inspect", "--format", "{{.Mountpoint}}", "swarm_runs")
        return Path(volume) / "short"

    def read_progress(self) -> ProgressLog:
        if self._progress is None:
            self._progress = ProgressLog(self.run_directory() / "progress.jsonl")
        self._progress.read()
        return self._progress


class Restarts(UnderFire):
    """The swarm, and what happens to it."""

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        self.swarm = swarm


@pytest.fixture(scope="module")
def training(images, control_run, tmp_path_factory) -> Iterator[Restarts]:
    keys = tmp_path_factory.mktemp("swarm") / "keys"
    Stack(images, "swarm-keys", keys).compose("run", "--rm", "keys")
    swarm = Swarm(images, keys)
    swarm.remove()
    swarm.deploy()
    try:
        yield Restarts(swarm)
    finally:
        swarm.remove()


def test_nobody_runs_where_no_label_says_so(training):
    """But the orchestrator, which asks for a manager alone."""
    swarm = training.swarm
    wait(lambda: swarm.states()["orchestrator"] == "Running", "the orchestrator")
    assert {name: swarm.states()[name] for name in ("render", "perception", "agent")} == {
        "render": "Pending",
        "perception": "Pending",
        "agent": "Pending",
    }
    swarm.label()
    wait(lambda: set(swarm.states().values()) == {"Running"}, "all of them")
    wait(lambda: swarm.read_progress().step > 0, "the first step")


def test_replicas_are_added_while_the_training_goes_on(training):
    training.suffer("swarm: two replicas of render", lambda: training.swarm.update("render", "--replicas", "2"))


@pytest.mark.parametrize("service", SERVICES)
def test_training_goes_on_during_a_rolling_restart(training, service):
    training.suffer(f"swarm: service update --force {service}", lambda: training.swarm.update(service, "--force"))


def test_in_the_end_all_is_as_if_nothing_had_happened(training, control_run):
    wait(lambda: set(training.swarm.states().values()) == {"Complete"}, "the end of all with exit code 0", 600)
    training.compare(control_run.run)
