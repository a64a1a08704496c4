"""A run on disk: its configuration, the versions that made it, its processes and its results.

The orchestrator makes the directory atomically and never overwrites one; the agent writes its records into it.
"""

from collections.abc import Collection, Generator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TypeVar

import msgspec
import psutil
import tomli_w
from msgspec import Struct

from orchestrator.errors import NoLocks, NoSuchRun, RunBusy, RunError, RunExists, RunNotWritable
from orchestrator.run.directory_lock import directory_lock
from orchestrator.run.ending import Ending
from orchestrator.run.json_lines import all_records, append_record, last_record
from orchestrator.run.restart import Restart
from orchestrator.run.versions import Versions
from protocol.artifact import checksum_if_there, require_place, sync_directory, whole_directory, whole_file
from protocol.config import RunConfig
from protocol.config_file import load_resolved_config, plain, require_recorded_files, resolved, same_for
from protocol.errors import DamagedRecord, InvalidInput
from protocol.grid.records import GridEvaluation
from protocol.messages import Role
from protocol.records import Evaluation, Progress, Summary
from protocol.system.process_start import ProcessStart
from protocol.system.refusal import reason
from protocol.text import UNDECODABLE, json_of, readable
from protocol.whole_record import decode_whole, read_whole

RUNS = Path("runs")
_TIME = "%Y%m%d-%H%M%S"
LOCK_PATIENCE = 0.5
"""Seconds; `is_busy` of another process holds the lock for less."""

RecordT = TypeVar("RecordT", bound=Struct)


class ProcessRecord(Struct, frozen=True, kw_only=True):
    """A process of the run as it was started: a line of `workers.json`.

    Attributes:
        address: where it serves; None for the agent, which serves nothing.
        started: its creation in seconds since 1970, by the wall clock as it was set then; for display.
        started_at: the same on a clock that is never set, which tells it from a later process with the same id; None in
            records of older versions.
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
    started_at: ProcessStart | None = None

    @property
    def identity(self) -> tuple[int, ProcessStart | float]:
        """What identifies the process: its id and its start."""
        return self.pid, self.started if self.started_at is None else self.started_at


class Plan(Struct, frozen=True, kw_only=True):
    """The plan of a run, which is not part of its configuration: `plan.json`.

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
            InvalidConfig: this machine lacks the memory that the run needs.
            RunExists: `path` exists.
            RunError: the system refuses to make it.
            NoLocks: its file system has no locks.
        """
        config.require_memory(psutil.virtual_memory().total)
        if path.exists():
            raise RunExists(f"{path} exists already, and a run is never overwritten; {_instead_of_making(path)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_directory(path) as aside:
                # Where it can't be locked, no orchestrator could work on it.
                with directory_lock(aside, 0.0, "", called=path):
                    pass
                (aside / "config.toml").write_bytes(resolved_toml(config))
                (aside / "versions.json").write_bytes(versions.to_json())
                (aside / "plan.json").write_bytes(msgspec.json.encode(plan) + b"\n")
                (aside / "logs").mkdir()
        except OSError as error:
            raise RunError(
                f"the run directory {path} can't be made: {reason(error)}; choose another place with --run"
            ) from error
        return cls(path)

    @classmethod
    def open(cls, path: Path) -> "RunDirectory":
        """Open a run.

        Raises:
            NoSuchRun: there is none at `path`.
        """
        run = cls(path)
        if not run.config_path.is_file():
            raise NoSuchRun(f"{path} is no run directory (it has no config.toml)")
        return run

    @property
    def name(self) -> str:
        """The directory's name, as text that can be sent."""
        return readable(self.path.resolve().name)

    @property
    def config_path(self) -> Path:
        """The resolved configuration, with every default; every process of the run reads it."""
        return self.path / "config.toml"

    @property
    def workers_path(self) -> Path:
        """The records of the processes that were last started on this run."""
        return self.path / "workers.json"

    @property
    def progress_path(self) -> Path:
        """The agent's progress, one JSON object a line."""
        return self.path / "progress.jsonl"

    @property
    def weights_path(self) -> Path:
        """The weights that the agent learned."""
        return self.path / "weights.safetensors"

    @property
    def summary_path(self) -> Path:
        """The summary of the training, also of one that was stopped."""
        return self.path / "summary.json"

    @property
    def restarts_path(self) -> Path:
        """Each restart of a process, one JSON object a line."""
        return self.path / "restarts.jsonl"

    @property
    def evaluation_path(self) -> Path:
        """The result of the evaluation."""
        return self.path / "evaluation.json"

    @property
    def grid_path(self) -> Path:
        """The details of the evaluation, of a run on the grid."""
        return self.path / "grid.json"

    @property
    def ending_path(self) -> Path:
        """How the last work on the run ended; missing while an orchestrator works on it."""
        return self.path / "ending.json"

    @property
    def logs(self) -> Path:
        """One file of JSON lines for each process."""
        return self.path / "logs"

    @property
    def orchestrator_log(self) -> Path:
        """The orchestrator's own log."""
        return self.logs / "orchestrator.jsonl"

    def config(self) -> RunConfig:
        """The configuration that the run was made with.

        Raises:
            InvalidConfig: the file is damaged.
        """
        return load_resolved_config(self.config_path)

    def whole_config(self) -> RunConfig:
        """The configuration, after a check that `plan.json` and `versions.json` are whole too.

        Raises:
            InvalidConfig, DamagedRecord: one of the three files is damaged.
        """
        self.plan()
        self.versions()
        return self.config()

    def verified_config(self) -> RunConfig:
        """`whole_config`, after a check that the files that it names are those that the run was made with.

        Raises:
            OtherArtifact: one of these files has another content now, or is gone.
        """
        config = self.whole_config()
        require_recorded_files(config)
        return config

    def config_matching(self, config: RunConfig) -> RunConfig:
        """`verified_config`, after a check that the run was made with this configuration.

        Raises:
            InvalidInput: it was made with another.
        """
        own = self.verified_config()
        if same_for(own) != same_for(config):
            raise InvalidInput(
                f"{self.path} was made with another configuration, and a run is never changed: continue it as it is "
                f"by 'orchestrator resume {self.path}', or choose another with --run"
            )
        return own

    def progress(self) -> Progress | None:
        """The agent's last progress; None before the first."""
        return last_record(self.progress_path, Progress)

    def summary(self) -> Summary | None:
        """The summary of the training; None before its end."""
        return _read(self.summary_path, Summary)

    def evaluation(self) -> Evaluation | None:
        """The last evaluation; None before the first."""
        return _read(self.evaluation_path, Evaluation, may_lack=("weights", "by"))

    def grid_evaluation(self) -> GridEvaluation | None:
        """The details of the last evaluation on the grid; None before the first, and in a run with flights."""
        return _read(self.grid_path, GridEvaluation)

    def ending(self) -> Ending | None:
        """How the last work on it ended; None during work, and after an orchestrator was killed."""
        return _read(self.ending_path, Ending)

    def begin(self) -> None:
        """Note that work begins: the earlier ending is removed durably, and a power cut can't bring it back."""
        self.ending_path.unlink(missing_ok=True)
        sync_directory(self.path)

    def end(self, ending: Ending) -> None:
        """Record how the work ended."""
        with whole_file(self.ending_path) as aside:
            aside.write_bytes(json_of(ending) + b"\n")

    def plan(self) -> Plan:
        """The plan of the run.

        Raises:
            DamagedRecord: the file is missing, can't be read, or lacks a field.
        """
        return read_whole(self.path / "plan.json", Plan)

    def versions(self) -> Versions:
        """What the run was made with; errors as `plan`."""
        return read_whole(self.path / "versions.json", Versions, may_lack=("made",))

    def is_trained(self) -> bool:
        """Whether the training is complete."""
        summary = self.summary()
        return summary is not None and summary.complete

    def is_finished(self) -> bool:
        """Whether all that was planned is done."""
        return self.is_trained() and (self.is_evaluated() or not self.plan().evaluate)

    def is_evaluated(self) -> bool:
        """Whether there is an evaluation of the present weights, of any number of flights."""
        evaluation = self.evaluation()
        if evaluation is None:
            return False
        if evaluation.by is None:
            return self._ended_with_an_evaluation()
        return evaluation.weights == checksum_if_there(self.weights_path)

    def is_evaluated_since(self, before: Evaluation | None) -> bool:
        """Whether another process than that of `before` has written an evaluation."""
        evaluation = self.evaluation()
        return evaluation is not None and (before is None or evaluation.by != before.by)

    def _ended_with_an_evaluation(self) -> bool:
        """Whether the evaluation came last, by the progress: in old runs, evaluations do not name their weights."""
        progress = self.progress()
        return progress is None or progress.phase == "evaluation"

    def processes(self) -> tuple[ProcessRecord, ...]:
        """The processes that were last started on this run."""
        try:
            return msgspec.json.decode(self.workers_path.read_bytes(), type=tuple[ProcessRecord, ...])
        except (OSError, *UNDECODABLE):
            return ()

    def write_processes(self, processes: Sequence[ProcessRecord]) -> None:
        """Record the processes of this run, for `status` and for the next orchestrator."""
        with whole_file(self.workers_path) as aside:
            aside.write_bytes(msgspec.json.format(json_of(processes), indent=2) + b"\n")

    def restarts(self) -> tuple[Restart, ...]:
        """Every restart of a process of this run so far."""
        return tuple(all_records(self.restarts_path, Restart))

    def note_restart(self, restart: Restart) -> None:
        """Record a restart."""
        append_record(self.restarts_path, restart)

    @contextmanager
    def lock(self, patience: float = LOCK_PATIENCE) -> Generator[None]:
        """Be the only orchestrator that works on this run; the system frees the lock when the process ends.

        Raises:
            RunBusy: another orchestrator works on it.
            NoLocks: its file system has no locks.
            RunNotWritable: the run is read-only.
        """
        otherwise = f"another orchestrator works on {self.path}; see 'orchestrator status {self.path}'"
        with directory_lock(self.path, patience, otherwise):
            self._require_writable()
            yield

    def is_busy(self) -> bool:
        """Whether an orchestrator works on this run now, as far as this user can tell."""
        try:
            with directory_lock(self.path, 0.0, ""):
                return False
        except RunBusy:
            return True
        except (NoLocks, OSError):
            # An orchestrator that can't lock the run can't work on it; reading needs no lock.
            return False

    def _require_writable(self) -> None:
        try:
            for place in (self.path, self.logs):
                require_place(place / "any")
        except OSError as error:
            raise RunNotWritable(
                f"{self.path} can't be written to ({reason(error)}), neither its logs nor its evaluation.json: copy "
                f"the run to a place that you may write to, and name the copy; 'orchestrator status {self.path}' and, "
                f"of a finished run, 'orchestrator resume {self.path}' only read"
            ) from error


def _instead_of_making(path: Path) -> str:
    if RunDirectory(path).config_path.is_file():
        return f"continue it by 'orchestrator resume {path}', or choose another with --run"
    return "choose another with --run"


def _read(path: Path, record: type[RecordT], *, may_lack: Collection[str] = ()) -> RecordT | None:
    """A record; None where the file is missing or damaged."""
    try:
        return decode_whole(path.read_bytes(), record, may_lack=may_lack)
    except (OSError, *UNDECODABLE):
        return None


def resolved_toml(config: RunConfig) -> bytes:
    """The resolved configuration as TOML: with every setting, and marked as resolved."""
    return tomli_w.dumps(resolved(config)).encode()


def plain_toml(config: RunConfig) -> bytes:
    """The configuration as TOML for a table's metadata, without the mark."""
    return tomli_w.dumps(plain(config)).encode()


def default_run_path(config_path: Path, now: datetime) -> Path:
    """`runs/<configuration's name>-<date>-<time>`."""
    return RUNS / f"{config_path.stem}-{now:{_TIME}}"


def newest_run(runs: Path = RUNS) -> RunDirectory:
    """The run that was made last.

    Raises:
        NoSuchRun: there is no run in `runs`.
    """
    made = [RunDirectory(config.parent) for config in sorted(runs.glob("*/config.toml"))]
    if not made:
        raise NoSuchRun(f"there is no run in {runs} yet; start one with 'orchestrator train CONFIG'")
    return max(made, key=_made)


def _made(run: RunDirectory) -> tuple[float, str]:
    """The sort key of a run by age: the recorded time, then the time in its name, for old runs have that only."""
    try:
        made = run.versions().made
    except DamagedRecord:
        made = 0.0
    return made, run.path.name[-len(f"{datetime.min:{_TIME}}") :]
