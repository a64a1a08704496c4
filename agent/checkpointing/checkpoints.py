"""The checkpoints of a run: written aside, synced, renamed, so that each is whole or not there; old ones are removed.

A crash at any moment leaves the newest whole checkpoint and perhaps a directory aside, which the next start removes.
"""

import contextlib
import logging
import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path

from agent.checkpointing.append_only_file import FileMark
from agent.checkpointing.checkpoint import (
    FORMAT,
    Checkpoint,
    Content,
    Grown,
    Manifest,
    read_checkpoint,
    read_manifest,
    write_files,
    write_manifest,
)
from agent.checkpointing.resume_fingerprint import fingerprint, require_same
from agent.errors import NewerFormat, NoWholeCheckpoint
from protocol.artifact import sync_directory, whole_directory
from protocol.config import RunConfig
from protocol.errors import ArtifactError
from protocol.failpoint import Failpoint, no_failpoint

_log = logging.getLogger(__name__)

_NAME = re.compile(r"step-\d{9,}")


class Checkpoints:
    """The checkpoints in `RUN/checkpoints`."""

    def __init__(self, directory: Path, config: RunConfig, failpoint: Failpoint = no_failpoint) -> None:
        self._directory = directory
        self._config = config
        self._reach = failpoint

    def newest(self) -> Checkpoint | None:
        """The newest whole checkpoint; damaged ones are skipped with a warning. None where there are none at all.

        Raises:
            NoWholeCheckpoint: there are some, all damaged.
            OtherConfig, NewerFormat: this training can't resume from the newest whole one.
        """
        paths = self._paths()
        for path in reversed(paths):
            try:
                checkpoint = read_checkpoint(path)
            except ArtifactError as error:
                _log.warning("passed over the damaged checkpoint %s: %s", path.name, error)
                continue
            require_same(checkpoint.manifest.config, self._config, str(path))
            return checkpoint
        if paths:
            raise NoWholeCheckpoint(f"all checkpoints in {self._directory} are damaged; remove it to begin anew")
        return None

    def tidy(self, newest: Checkpoint | None) -> None:
        """Remove unfinished checkpoints of a killed process, and damaged ones after the newest whole one."""
        if not self._directory.is_dir():
            return
        for path in self._directory.glob(".step-*"):
            shutil.rmtree(path)
        for path in self._paths():
            if newest is not None and _step_of(path) > newest.manifest.step:
                shutil.rmtree(path)

    def write(self, content: Content, sync_grown: Callable[[], Grown]) -> None:
        """Add a checkpoint, and remove those that are neither among the last ones nor the best.

        Args:
            sync_grown: syncs the append-only files to the disk; returns their marks.

        Raises:
            OSError: for example, the disk is full; then everything is as before.
        """
        self._directory.mkdir(exist_ok=True)
        with whole_directory(self._directory / _name(content.step)) as aside:
            self._reach("checkpoint-opened")
            grown = sync_grown()
            # The directory entries of these files, and of the checkpoints' own directory.
            sync_directory(self._directory.parent)
            self._reach("checkpoint-journal-synced")
            files = write_files(aside, content)
            self._reach("checkpoint-written")
            write_manifest(aside, self._manifest(content, files, grown))
            self._reach("checkpoint-manifest-written")
        self._reach("checkpoint-renamed")
        self._prune()
        self._reach("checkpoint-pruned")

    def _manifest(self, content: Content, files: dict[str, FileMark], grown: Grown) -> Manifest:
        return Manifest(
            format=FORMAT,
            step=content.step,
            mean_return=content.mean_return,
            config=fingerprint(self._config),
            files=files,
            grown=grown,
        )

    def _paths(self) -> list[Path]:
        """All directories with a checkpoint's name, oldest first."""
        if not self._directory.is_dir():
            return []
        return sorted(
            (path for path in self._directory.iterdir() if _NAME.fullmatch(path.name)),
            key=_step_of,
        )

    def _prune(self) -> None:
        paths = self._paths()
        best = self._best(paths)
        for path in paths[: -self._config.training.keep_checkpoints]:
            if path != best:
                shutil.rmtree(path, ignore_errors=True)

    def _best(self, paths: list[Path]) -> Path | None:
        """The checkpoint with the best mean return of the last flights; of equals, the newest."""
        best, most = None, -math.inf
        for path in paths:
            with contextlib.suppress(ArtifactError, NewerFormat):
                mean_return = read_manifest(path).mean_return
                if mean_return is not None and mean_return >= most:
                    best, most = path, mean_return
        return best


def _name(step: int) -> str:
    return f"step-{step:09d}"


def _step_of(path: Path) -> int:
    return int(path.name.partition("-")[2])
