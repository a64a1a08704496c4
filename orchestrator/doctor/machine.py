"""Checks of the machine itself."""

import platform
import shutil
import socket
import sys
import tempfile
from pathlib import Path

import psutil
import zmq

from orchestrator.doctor.check import Check
from orchestrator.run.directory_lock import directory_lock
from orchestrator.run.runs import RUNS
from orchestrator.run.socket_directory import socket_directory
from protocol.artifact import cache_directory, whole_file
from protocol.system.cores import available_cores

OLDEST_PYTHON = (3, 11)
LEAST_MEMORY = 2 * 2**30
LEAST_DISK = 2**30
LEAST_CORES = 2


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
    """At least two cores, so that rendering and perceiving overlap."""
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
    """Runs are written below the current directory."""
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


def check_files(runs: Path = RUNS) -> Check:
    """A run's files can be written where runs are made, whole, and its directory locked.

    Raises:
        OSError, NoLocks: they can't.
    """
    nearest = next(folder for folder in (runs, *runs.absolute().parents) if folder.is_dir())
    with tempfile.TemporaryDirectory(prefix=".vantage-doctor-", dir=nearest) as directory:
        folder = Path(directory)
        with directory_lock(folder, 0.0, "another process has locked it"), whole_file(folder / "file") as aside:
            aside.write_bytes(b"written")
    return Check(name="files", passed=True, found=f"written and locked in {nearest.absolute()}")


def check_cache() -> Check:
    """There is a cache directory for the files that set-up makes.

    Raises:
        Unavailable: the user has no home, and `VANTAGE_CACHE` names no place.
    """
    return Check(name="cache", passed=True, found=str(cache_directory()))


def check_own_name() -> Check:
    """The machine can resolve its own host name, which it tells other machines."""
    name = socket.gethostname()
    try:
        found = sorted({str(at[4][0]) for at in socket.getaddrinfo(name, None)})
    except (OSError, UnicodeError) as error:
        remedy = f"add '127.0.1.1 {name}' to /etc/hosts; only work with other machines needs it (or --advertise)"
        return Check(name="own name", passed=False, needed=False, found=f"{name}: {error}", remedy=remedy)
    return Check(name="own name", passed=True, found=f"{name} is {', '.join(found)}")
