"""A run on disk: what it was told, what made it, who works on it and what came out.

The orchestrator makes the directory whole or not at all and never overwrites one; the agent writes its records into it.
"""

import shutil
import tempfile
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TypeVar

import msgspec
import psutil
import tomli_w
from msgspec import Struct

from orchestrator.directory_lock import directory_lock
from orchestrator.errors import NoSuchRun, RunBusy, RunError, RunExists
from orchestrator.json_lines import all_records, append_record, last_record
from orchestrator.restart import Restart
from orchestrator.versions import Versions
from protocol.artifact import whole_file
from protocol.config import RunConfig, load_config
from protocol.errors import InvalidInput
from protocol.messages import Role
from protocol.records import Evaluation, Progress, Summary

RUNS = Path("runs")
LOCK_PATIENCE = 0.5
"""Seconds; whoever only looks whether a run is busy holds its lock for less."""

RecordT = TypeVar("RecordT", bound=Struct)


class ProcessRecord(Struct, frozen=True, kw_only=True):
    """A process of the run as it was started: a line of `workers.json`.

    Attributes:
        address: where it serves; none for the agent, which serves nothing.
        started: the process's creation, in seconds since the epoch; tells it from a later process of the same number.
        log: its log, relative to the run directory.
        log_start: the byte there at which its own lines begin.
    """

    name: str
    role: Role
    address: str | None
    pid: int
    started: float
    log: str
    log_start: int = 0


class Plan(Struct, frozen=True, kw_only=True):
    """What is to be done in a run, beside its configuration: `plan.json`.

    Attributes:
        evaluate: whether an evaluation follows the training.
    """

    evaluate: bool = True


DEFAULT_PLAN = Plan()


class RunDirectory(Struct, frozen=True):
    """The files of one run."""

    path: Path

    @classmethod
    def create(cls, path: Path, config: RunConfig, versions: Versions, plan: Plan = DEFAULT_PLAN) -> "RunDirectory":
        """Make a new run.

        Raises:
            InvalidConfig: this machine has not the memory that the run asks for.
            RunExists: something is at `path` already.
            RunError: the system would not make it.
        """
        config.require_memory(psutil.virtual_memory().total)
        if path.exists():
            raise RunExists(f"{path} exists already, and a run is never overwritten; {_instead_of_making(path)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with _directory_aside(path) as aside:
                (aside / "config.toml").write_bytes(resolved_toml(config))
                (aside / "versions.json").write_bytes(versions.to_json())
                (aside / "plan.json").write_bytes(msgspec.json.encode(plan) + b"\n")
                (aside / "logs").mkdir()
        except OSError as error:
            raise RunError(f"the run directory {path} can't be made: {error.strerror}") from error
        return cls(path)

    @classmethod
    def open(cls, path: Path) -> "RunDirectory":
        """Take up a run that is there.

        Raises:
            NoSuchRun: there is none.
        """
        run = cls(path)
        if not run.config_path.is_file():
            raise NoSuchRun(f"{path} is no run directory (it has no config.toml)")
        return run

    @classmethod
    def open_for(cls, path: Path, config: RunConfig) -> "RunDirectory":
        """Take up a run that was made with this configuration; errors as `open`.

        Raises:
            InvalidInput: it was made with another.
        """
        run = cls.open(path)
        if run.config() != config:
            raise InvalidInput(
                f"{path} was made with another configuration, and a run is never changed: go on with it as it is by "
                f"'orchestrator resume {path}', or choose another with --run"
            )
        return run

    @property
    def name(self) -> str:
        """The directory's own name."""
        return self.path.resolve().name

    @property
    def config_path(self) -> Path:
        """The resolved configuration, with every default; every process is started on it."""
        return self.path / "config.toml"

    @property
    def workers_path(self) -> Path:
        """The processes that were last started on this run."""
        return self.path / "workers.json"

    @property
    def progress_path(self) -> Path:
        """Where the agent writes how far it is."""
        return self.path / "progress.jsonl"

    @property
    def weights_path(self) -> Path:
        """What the agent learned."""
        return self.path / "weights.safetensors"

    @property
    def summary_path(self) -> Path:
        """How the agent's training ended, or was stopped."""
        return self.path / "summary.json"

    @property
    def restarts_path(self) -> Path:
        """Each restart of a process, one JSON object a line."""
        return self.path / "restarts.jsonl"

    @property
    def evaluation_path(self) -> Path:
        """What the agent's evaluation gave."""
        return self.path / "evaluation.json"

    @property
    def logs(self) -> Path:
        """One file of JSON lines for each process."""
        return self.path / "logs"

    @property
    def orchestrator_log(self) -> Path:
        """What the orchestrator itself had to say."""
        return self.logs / "orchestrator.jsonl"

    def config(self) -> RunConfig:
        """What the run was told.

        Raises:
            InvalidConfig: the file was damaged.
        """
        return load_config(self.config_path)

    def progress(self) -> Progress | None:
        """How far the agent is; None before its first word."""
        return last_record(self.progress_path, Progress)

    def summary(self) -> Summary | None:
        """How the training ended; None before that."""
        return _read(self.summary_path, Summary)

    def evaluation(self) -> Evaluation | None:
        """The last evaluation; None before the first."""
        return _read(self.evaluation_path, Evaluation)

    def plan(self) -> Plan:
        """What is to be done here."""
        return _read(self.path / "plan.json", Plan) or DEFAULT_PLAN

    def is_trained(self) -> bool:
        """Whether the training has come to its end."""
        summary = self.summary()
        return summary is not None and summary.complete

    def is_finished(self) -> bool:
        """Whether all that was planned is done."""
        return self.is_trained() and (self.is_evaluated() or not self.plan().evaluate)

    def is_evaluated(self, since: float = 0.0) -> bool:
        """Whether there is an evaluation of what was last trained, written after `since` (seconds since 1970)."""
        written = _written(self.evaluation_path)
        return self.evaluation() is not None and written >= max(since, _written(self.summary_path))

    def processes(self) -> tuple[ProcessRecord, ...]:
        """The processes that were last started on this run."""
        try:
            return msgspec.json.decode(self.workers_path.read_bytes(), type=tuple[ProcessRecord, ...])
        except (OSError, msgspec.MsgspecError):
            return ()

    def write_processes(self, processes: Sequence[ProcessRecord]) -> None:
        """Note which processes work on this run, for `status` and for whoever takes the run over."""
        with whole_file(self.workers_path) as aside:
            aside.write_bytes(msgspec.json.format(msgspec.json.encode(processes), indent=2) + b"\n")

    def restarts(self) -> tuple[Restart, ...]:
        """Every restart of a process of this run so far."""
        return tuple(all_records(self.restarts_path, Restart))

    def note_restart(self, restart: Restart) -> None:
        """Write a restart down."""
        append_record(self.restarts_path, restart)

    @contextmanager
    def lock(self, patience: float = LOCK_PATIENCE) -> Generator[None]:
        """Be the only orchestrator that works on this run; the system frees the lock however we end.

        Raises:
            RunBusy: another one does.
        """
        otherwise = f"another orchestrator works on {self.path}; see 'orchestrator status {self.path}'"
        with directory_lock(self.path, patience, otherwise):
            yield

    def is_busy(self) -> bool:
        """Whether an orchestrator works on this run now."""
        try:
            with self.lock(patience=0.0):
                return False
        except RunBusy:
            return True


def _instead_of_making(path: Path) -> str:
    if RunDirectory(path).config_path.is_file():
        return f"go on with it by 'orchestrator resume {path}', or choose another with --run"
    return "choose another with --run"


def _written(path: Path) -> float:
    """When a file was last written, in seconds since 1970; 0 where there is none."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


@contextmanager
def _directory_aside(path: Path) -> Generator[Path]:
    """A directory beside `path` to fill; it gets that name when all is in it."""
    aside = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        yield aside
        aside.chmod(0o755)
        # A rename replaces an empty directory at most and fails on any other: nothing is ever lost.
        aside.rename(path)
    except BaseException:
        shutil.rmtree(aside, ignore_errors=True)
        raise


def _read(path: Path, record: type[RecordT]) -> RecordT | None:
    try:
        return msgspec.json.decode(path.read_bytes(), type=record)
    except (OSError, msgspec.MsgspecError):
        return None


def resolved_toml(config: RunConfig) -> bytes:
    """The configuration with every field written out; what is None is left away, as TOML has no null."""
    return tomli_w.dumps(_without_none(msgspec.to_builtins(config))).encode()


def _without_none(table: dict[str, object]) -> dict[str, object]:
    return {
        key: _without_none(value) if isinstance(value, dict) else value
        for key, value in table.items()
        if value is not None
    }


def default_run_path(config_path: Path, now: datetime) -> Path:
    """`runs/<configuration's name>-<date>-<time>`."""
    return RUNS / f"{config_path.stem}-{now:%Y%m%d-%H%M%S}"


def newest_run(runs: Path = RUNS) -> RunDirectory:
    """The run that was made last.

    Raises:
        NoSuchRun: there is none.
    """
    made = sorted(runs.glob("*/config.toml"), key=lambda config: config.stat().st_mtime)
    if not made:
        raise NoSuchRun(f"there is no run in {runs} yet; start one with 'orchestrator train CONFIG'")
    return RunDirectory(made[-1].parent)
