import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.run_directory import ProcessRecord, RunDirectory
from orchestrator.stop_request import StopRequest
from protocol.config import RunConfig, TimeoutsConfig
from protocol.messages import Role

SLEEP = (sys.executable, "-c", "import time; time.sleep(600)")
WORKERS = Path(__file__).parents[1] / "workers"


@pytest.fixture
def rehearsed(tmp_path, versions) -> Iterator[RehearsedRun]:
    """A run that no orchestrator works on."""
    directory = RunDirectory.create(tmp_path / "run", RunConfig(), versions)
    directory.write_processes(())
    run = RehearsedRun(tmp_path / "c.toml", directory.path, TimeoutsConfig(), StopRequest(), lambda _: None)
    with run:
        yield run


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
