"""The control run: a run without faults that the others are compared with, made once for a configuration and code."""

import hashlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from msgspec import Struct

from orchestrator.chaos.errors import RehearsalFailed
from orchestrator.chaos.progress_log import ProgressLog
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT
from protocol.config import RunConfig
from protocol.config_file import with_checksums
from protocol.system.stop_request import StopRequest

SOURCES = {".py", ".vert", ".frag"}
ROOMS = ("protocol", "render_worker", "perception_worker", "agent", "orchestrator")


class ControlRun(Struct, frozen=True):
    """A complete run without faults.

    Attributes:
        steps: environment steps of all drones, prefill included.
        reused: whether an earlier rehearsal made it.
    """

    directory: RunDirectory
    steps: int
    reused: bool


def control_run(
    config_path: Path, config: RunConfig, runs: Path, stop: StopRequest, show: Callable[[RehearsedRun], None]
) -> ControlRun:
    """The control run of a configuration; reused from `runs` if the same code made it there.

    Args:
        config_path: the file that `config` was read from; the orchestrator of the run is started on it.

    Raises:
        RunBusy: another rehearsal makes it right now.
        RehearsalFailed: it ended before its training was done.
    """
    directory = RunDirectory(runs / f"control-{identity(config)}")
    reused = directory.is_trained()
    if not reused:
        _remove_unfinished(directory)
        with RehearsedRun(config_path, directory.path, config.timeouts, stop, show) as run:
            run.begin()
            run.finish()
    return ControlRun(directory, _steps(directory), reused)


def _remove_unfinished(directory: RunDirectory) -> None:
    if directory.path.exists():
        with directory.lock():
            shutil.rmtree(directory.path)


def _steps(directory: RunDirectory) -> int:
    progress = ProgressLog(directory.progress_path)
    progress.read()
    if not directory.is_trained() or not progress.is_done:
        raise RehearsalFailed(f"the control run {directory.path} has ended before its training was done")
    return progress.step


def identity(config: RunConfig) -> str:
    """A short digest of all that the result of a run depends on: configuration, code and packages."""
    digest = hashlib.sha256(resolved_toml(with_checksums(config)))
    for path in _sources():
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    digest.update(repr(sorted(collect_versions(PROCESS_ENVIRONMENT).packages.items())).encode())
    return digest.hexdigest()[:12]


def _sources() -> Iterator[Path]:
    chaos = Path(__file__).parent
    for room in ROOMS:
        paths = sorted((chaos.parents[1] / room).rglob("*"))
        # The chaos package only observes a control run.
        yield from (path for path in paths if path.suffix in SOURCES and chaos not in path.parents)
