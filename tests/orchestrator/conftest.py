import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.versions import Versions
from orchestrator.supervision.launch import Launch
from protocol.config import RunConfig
from protocol.messages import Role

ROOMS = Path(__file__).parent / "rooms"
PATIENCE = 120.0


@pytest.fixture
def rooms() -> Path:
    """Folders of stand-ins for the rooms whose processes the orchestrator starts."""
    return ROOMS


@pytest.fixture
def versions() -> Versions:
    return Versions(
        vantage="0.1.0",
        commit=None,
        protocol=1,
        python="3.11.7",
        platform="Linux",
        cores=2,
        packages={"numpy": "2.0"},
        environment={"OMP_NUM_THREADS": "1"},
    )


@pytest.fixture
def run(tmp_path: Path, versions: Versions) -> RunDirectory:
    return RunDirectory.create(tmp_path / "run", RunConfig(), versions)


@pytest.fixture
def python_launch() -> Callable[..., Launch]:
    """A process that runs a few lines of Python."""

    def launch(code: str, name: str = "render-0", role: Role = Role.RENDER, address: str | None = None) -> Launch:
        return Launch(name=name, role=role, command=(sys.executable, "-c", code), address=address)

    return launch


@pytest.fixture
def wait_until() -> Callable[[Callable[[], bool]], None]:
    """Waits for something that must come true."""

    def wait(condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > deadline:
                pytest.fail("what was waited for did not happen")
            time.sleep(0.02)

    return wait


class Command:
    """The `orchestrator` command, with stand-ins for the rooms whose processes it starts."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.temporary = folder / "tmp"
        self.temporary.mkdir()
        self.children: list[subprocess.Popen[str]] = []

    def start(
        self,
        *arguments: str,
        rooms: tuple[str, ...] | None = (),
        module: str = "orchestrator",
        before: tuple[str, ...] = (),
    ) -> subprocess.Popen[str]:
        """`rooms` are misbehaving stand-ins, the well-behaved ones fill in for the rest; with None, the real ones.

        `before` is another command, which is given this one to run.
        """
        environment = os.environ | {"TMPDIR": str(self.temporary), "COLUMNS": "200"}
        if rooms is not None:
            stand_ins = [str(ROOMS / room) for room in (*rooms, "well_behaved")]
            environment["PYTHONPATH"] = os.pathsep.join([*stand_ins, *filter(None, [os.environ.get("PYTHONPATH")])])
            environment["VANTAGE_CACHE"] = str(self.folder / "cache")
        child = subprocess.Popen(
            [*before, sys.executable, "-m", module, *arguments],
            cwd=self.folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.children.append(child)
        return child

    def alive(self) -> set[int]:
        """The ids of all running processes that were started in the folder, by any process."""
        return {process.pid for process in processes_in(self.folder)}

    def run(
        self, *arguments: str, rooms: tuple[str, ...] | None = (), patience: float = PATIENCE
    ) -> subprocess.CompletedProcess[str]:
        child = self.start(*arguments, rooms=rooms)
        out, err = child.communicate(timeout=patience)
        return subprocess.CompletedProcess(arguments, child.returncode, out, err)


def processes_in(folder: Path) -> list[psutil.Process]:
    """Those that were started in a folder and still run."""
    found = psutil.process_iter(["cwd", "status"])
    return [one for one in found if one.info["cwd"] == str(folder) and one.info["status"] != psutil.STATUS_ZOMBIE]


@pytest.fixture
def orchestrator(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Command]:
    # Sockets need a short path, which a test's own folder may not have.
    command = Command(tmp_path_factory.mktemp("o"))
    yield command
    # The processes of a killed orchestrator have no common parent, but were started in the same folder.
    for process in processes_in(command.folder):
        with suppress(psutil.NoSuchProcess):
            process.kill()
    for child in command.children:
        child.wait(PATIENCE)
        for stream in (child.stdout, child.stderr):
            if stream is not None:
                stream.close()


@pytest.fixture
def worker_launch(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Launch]:
    """One of the programs in `workers/`, told to serve at an address of its own."""
    sockets = tmp_path_factory.mktemp("s")

    def launch(program: str, name: str = "render-0") -> Launch:
        address = f"ipc://{sockets}/{name}"
        command = (sys.executable, str(Path(__file__).parent / "workers" / f"{program}.py"), address)
        return Launch(name=name, role=Role.RENDER, command=command, address=address)

    return launch
