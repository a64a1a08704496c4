"""A run on disk: its configuration, the versions that made it, its processes and its results.

The orchestrator makes the directory atomically and never overwrites one; the agent writes its records into it.
"""

from collections.abc import Collection, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec
import psutil
from msgspec import Struct

from orchestrator.errors import NoLocks, NoSuchRun, RunBusy, RunError, RunExists, RunNotWritable
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.directory_lock import directory_lock
from orchestrator.run.ending import Ending
from orchestrator.run.json_lines import all_records, append_record, last_record
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.restart import Restart
from orchestrator.run.run_files import RunFiles
from orchestrator.run.versions import Versions
from protocol.artifact import checksum_if_there, require_place, sync_directory, whole_directory, whole_file
from protocol.config import RunConfig
from protocol.config_file import load_resolved_config, require_recorded_files, same_for
from protocol.errors import InvalidInput
from protocol.grid.records import GridEvaluation
from protocol.records import Evaluation, Progress, Summary
from protocol.system.refusal import reason
from protocol.text import UNDECODABLE, json_of
from protocol.whole_record import decode_whole, read_whole

LOCK_PATIENCE = 0.5
"""Seconds; `is_busy` of another process holds the lock for less."""

RecordT = TypeVar("RecordT", bound=Struct)


class Plan(Struct, frozen=True, kw_only=True):
    """The plan of a run, which is not part of its configuration: `plan.json`.

    Attributes:
        evaluate: whether an evaluation follows the training.
    """

    evaluate: bool = True


DEFAULT_PLAN = Plan()


class RunDirectory(RunFiles, frozen=True):
    """The content of one run's files."""

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
        return _read(self.evaluation_path, Evaluation, may_lack=("weights", "by", "in_metres"))

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
