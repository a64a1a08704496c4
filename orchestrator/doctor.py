"""Whether this machine has what Vantage needs, and what to do about each thing that it lacks."""

import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import psutil
import zmq
from msgspec import Struct
from packaging.requirements import Requirement
from rich.table import Table
from rich.text import Text

from orchestrator.launch import module_command
from orchestrator.socket_directory import socket_directory
from orchestrator.versions import installed_version, requirements
from orchestrator.worker_process import ending
from protocol.artifact import cache_directory
from protocol.cores import available_cores

OLDEST_PYTHON = (3, 11)
ROOMS = ("render", "perception", "agent", "orchestrator")
LEAST_MEMORY = 2 * 2**30
LEAST_DISK = 2**30
LEAST_CORES = 2
PROBE_PATIENCE = 120.0
LOAD_BODIES = """
from render_worker.assets import assets_path, load_assets
load_assets(assets_path())
print(f"{assets_path()} is there and whole")
"""
"""The render room has no command that only looks; a process of its own keeps its packages out of this one."""


class Check(Struct, frozen=True, kw_only=True):
    """One line of the doctor's list.

    Attributes:
        needed: whether nothing works without it; else it is only slower.
        found: what is there.
        remedy: what to do where it failed; empty where it passed.
    """

    name: str
    passed: bool
    needed: bool = True
    found: str
    remedy: str = ""


def all_checks() -> Iterator[Check]:
    """Every check, one after the other, quick ones first."""
    checks: tuple[Callable[[], Check], ...] = (check_python, check_cores, check_memory, check_disk, check_sockets)
    yield from (check() for check in checks)
    declared = tuple(requirements())
    yield from (check_packages(room, declared) for room in ROOMS)
    yield check_opengl()
    yield check_network()
    yield check_bodies()


def all_needed_passed(checks: Iterable[Check]) -> bool:
    """Whether Vantage can run here."""
    return all(check.passed or not check.needed for check in checks)


def check_python(version: tuple[int, ...] = sys.version_info[:3]) -> Check:
    """Python is new enough."""
    oldest = ".".join(map(str, OLDEST_PYTHON))
    return Check(
        name="Python",
        passed=version >= OLDEST_PYTHON,
        found=f"{'.'.join(map(str, version))} on {platform.system()} {platform.machine()}",
        remedy="" if version >= OLDEST_PYTHON else f"install Python {oldest} or newer, and make the environment anew",
    )


def check_cores() -> Check:
    """Rendering and perceiving overlap only on two cores."""
    cores = available_cores()
    enough = cores >= LEAST_CORES
    remedy = "" if enough else "it works, at about half the speed; more cores help"
    return Check(name="cores", passed=enough, needed=False, found=str(cores), remedy=remedy)


def check_memory(available: int | None = None) -> Check:
    """The three kinds of process need some 2 GiB together."""
    available = psutil.virtual_memory().available if available is None else available
    enough = available >= LEAST_MEMORY
    remedy = "" if enough else f"free some: a run on one machine needs {LEAST_MEMORY // 2**30} GiB"
    return Check(name="memory", passed=enough, found=f"{available / 2**30:.1f} GiB available", remedy=remedy)


def check_disk(folder: Path | None = None) -> Check:
    """Runs are written where the command is called."""
    folder = folder or Path.cwd()
    free = shutil.disk_usage(folder).free
    enough = free >= LEAST_DISK
    remedy = "" if enough else f"free some: a run can take {LEAST_DISK // 2**30} GiB"
    return Check(name="disk", passed=enough, found=f"{free / 2**30:.0f} GiB free in {folder}", remedy=remedy)


def check_sockets() -> Check:
    """A worker can serve on an `ipc://` socket and on a free port."""
    with zmq.Context() as context, context.socket(zmq.ROUTER) as local, context.socket(zmq.ROUTER) as port:
        try:
            with socket_directory() as sockets:
                local.bind(f"ipc://{sockets}/doctor")
                port.bind("tcp://127.0.0.1:*")
                found = f"ipc in {sockets.parent}, and free ports"
        except (OSError, zmq.ZMQError) as error:
            remedy = "set TMPDIR to a directory that you may write to, with a path of at most 50 characters"
            return Check(name="sockets", passed=False, found=str(error), remedy=remedy)
    return Check(name="sockets", passed=True, found=found)


def check_packages(room: str, declared: Iterable[Requirement]) -> Check:
    """A room's packages are there, in versions that it can use."""
    wanted = [requirement for requirement in declared if belongs_to(requirement, room)]
    lacking = [str(requirement.name) + str(requirement.specifier) for requirement in wanted if not is_met(requirement)]
    own = [requirement for requirement in wanted if requirement.marker is not None]
    present = [f"{requirement.name} {installed_version(requirement.name)}" for requirement in own]
    install = f"pip install 'vantage[{room}]' (in a checkout: pip install -c constraints.txt -e '.[{room}]')"
    if not wanted:
        return Check(name=f"{room} packages", passed=False, found="Vantage itself is not installed", remedy=install)
    found = f"missing or too old: {', '.join(lacking)}" if lacking else ", ".join(present)
    return Check(name=f"{room} packages", passed=not lacking, found=found, remedy=install if lacking else "")


def belongs_to(requirement: Requirement, room: str) -> bool:
    """Whether a room needs a package that Vantage's metadata names: its own extra's, or everybody's."""
    return requirement.marker is None or requirement.marker.evaluate({"extra": room})


def is_met(requirement: Requirement) -> bool:
    """Whether it is installed in a version that was asked for."""
    version = installed_version(requirement.name)
    return version is not None and requirement.specifier.contains(version, prereleases=True)


def check_opengl() -> Check:
    """Something can render without a screen."""
    return probe(
        "OpenGL over EGL",
        module_command("orchestrator.gl_probe"),
        remedy="install a driver (Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri), "
        "then 'orchestrator doctor' again",
    )


def check_network() -> Check:
    """The pose network is in the cache and whole."""
    return probe("pose network", module_command("perception_worker.models", "check"), remedy="orchestrator models pull")


def check_bodies() -> Check:
    """The bodies are in the cache and whole."""
    return probe("bodies", (sys.executable, "-P", "-c", LOAD_BODIES), remedy="orchestrator bodies bake")


def probe(name: str, command: tuple[str, ...], remedy: str) -> Check:
    """Ask a process; it passes by its exit code, and its last line is what was found."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PROBE_PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return Check(name=name, passed=False, found=f"no answer within {PROBE_PATIENCE:g} s", remedy=remedy)
    except OSError as error:
        return Check(name=name, passed=False, found=str(error), remedy=remedy)
    passed = done.returncode == 0
    return Check(name=name, passed=passed, found=_said(done), remedy="" if passed else remedy)


def _said(done: subprocess.CompletedProcess[str]) -> str:
    if done.returncode < 0:
        # A process that a signal killed (a broken driver, say) has said nothing of it itself.
        return ending(done.returncode)
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    # A traceback ends with the error's type, which says nothing to people.
    return re.sub(r"^(\w+\.)+\w+: ", "", lines[-1]) if lines else "no word"


def checks_table(checks: Iterable[Check]) -> Table:
    """A line a check, and below each failed one what to do."""
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    table.add_column()
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in checks:
        mark = (
            Text("ok", "green")
            if check.passed
            else Text("FAILED", "bold red")
            if check.needed
            else Text("slow", "yellow")
        )
        table.add_row(mark, Text(check.name), Text(check.found))
        if check.remedy:
            table.add_row("", "", Text(f"→ {check.remedy}", "bold"))
    table.add_row("", "cache", Text(str(cache_directory()), "dim"))
    return table
