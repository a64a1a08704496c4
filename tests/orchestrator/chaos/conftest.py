import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.run_directory import RunDirectory
from protocol.config import RunConfig, TimeoutsConfig
from protocol.failpoint import Failpoints
from protocol.messages import Role
from protocol.system.stop_request import StopRequest

SLEEP = (sys.executable, "-c", "import time; time.sleep(600)")
WORKERS = Path(__file__).parents[1] / "workers"
DRONES = 4


@pytest.fixture
def rehearsed(tmp_path, versions) -> Iterator[RehearsedRun]:
    """A run that no orchestrator works on."""
    directory = RunDirectory.create(tmp_path / "run", RunConfig(), versions)
    directory.write_processes(())
    run = RehearsedRun(tmp_path / "c.toml", directory.path, TimeoutsConfig(), StopRequest(), lambda _: None)
    with run:
        yield run


class Flown(threading.Thread):
    """A training in no time: it waits where it is held, and does nothing else."""

    def __init__(self, failpoints: Failpoints, steps: int) -> None:
        super().__init__(daemon=True)
        self.flown = 0
        self._failpoints = failpoints
        self._steps = steps

    def run(self) -> None:
        while self.flown < self._steps:
            self._failpoints.reach(f"step-{self.flown}")
            self.flown += DRONES


@pytest.fixture
def fly(rehearsed) -> Callable[[int], Flown]:
    """Begins a training of so many steps of the run; what holds it ends with the run."""

    def fly(steps: int) -> Flown:
        training = Flown(rehearsed.failpoints, steps)
        training.start()
        return training

    return fly


@pytest.fixture
def start(rehearsed) -> Iterator[Callable[..., ProcessRecord]]:
    """Starts a plain process and enters it in the run's table, in the place of one of the same name."""
    children: list[subprocess.Popen[bytes]] = []

    def start(name: str, role: Role, *, command: tuple[str, ...] = SLEEP, address: str | None = None) -> ProcessRecord:
        child = subprocess.Popen(command)
        children.append(child)
        record = ProcessRecord(
            name=name,
            role=role,
            address=address,
            pid=child.pid,
            started=psutil.Process(child.pid).create_time(),
            log="none",
        )
        others = [other for other in rehearsed.directory.processes() if other.name != name]
        rehearsed.directory.write_processes((*others, record))
        return record

    yield start
    for child in children:
        child.kill()
        child.wait(30)


@pytest.fixture
def start_worker(start, tmp_path_factory) -> Callable[..., ProcessRecord]:
    """Starts a real worker that has nothing to serve."""
    sockets = tmp_path_factory.mktemp("s")

    def start_worker(name: str = "render-0", address: str | None = None) -> ProcessRecord:
        address = address or f"ipc://{sockets}/{name}"
        command = (sys.executable, str(WORKERS / "serves_nothing.py"), address)
        return start(name, Role.RENDER, command=command, address=address)

    return start_worker
