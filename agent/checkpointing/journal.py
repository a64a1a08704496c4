"""The records that a training writes while it runs, for people and for the orchestrator.

Only the finished flights are part of its result. Other records may have gaps: where the disk is full, the training
warns once and continues.
"""

import contextlib
import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import msgspec
from msgspec.structs import replace

from agent.checkpointing.append_only_file import AppendOnlyFile, FileMark
from agent.observer import NO_OBSERVER
from protocol.artifact import whole_file
from protocol.grid.records import GridEvaluation
from protocol.records import Episode, Evaluation, Progress, Summary
from protocol.system.process_start import own_start

if TYPE_CHECKING:
    from torch.utils.tensorboard.writer import SummaryWriter

_log = logging.getLogger(__name__)

EPISODES, _PROGRESS = "episodes.jsonl", "progress.jsonl"


class Journal:
    """The records of a run directory: progress and episodes by the line, curves, and a summary at the end.

    Args:
        run: the run directory.
        episodes: bytes of the finished flights that a training resumes from; by default, all of the file.
        flown: environment steps that it resumes from; later points of curves are removed.
        on_progress: called with each line of progress, whether or not the disk has room for it.
    """

    def __init__(
        self,
        run: Path,
        *,
        episodes: int | None = None,
        flown: int = 0,
        on_progress: Callable[[Progress], None] = NO_OBSERVER.progress,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._run = run
        self._on_progress = on_progress
        self._flown = flown
        self._progress = AppendOnlyFile(run / _PROGRESS, _length_of(run / _PROGRESS))
        self._episodes = AppendOnlyFile(run / EPISODES, _length_of(run / EPISODES) if episodes is None else episodes)
        self._curves: SummaryWriter | None = None
        self._failing = False
        self._process = own_start()
        self._clock = clock

    def progress(self, progress: Progress) -> None:
        """Add a line on how far the training is; readers see it, and all episodes so far, at once.

        It names the process that wrote it, and the time by a steady clock, so that readers know which agent wrote it.
        """
        _add_line(self._progress, replace(progress, process=self._process, steady=self._clock()))
        self._try(self._progress.write)
        self._try(self._episodes.write)
        self._on_progress(progress)

    def episode(self, episode: Episode) -> None:
        """Add a line for a finished flight; it is written with the next progress."""
        _add_line(self._episodes, episode)

    def curves(self, step: int, values: Mapping[str, float]) -> None:
        """Add a point to each of TensorBoard's curves."""
        self._try(lambda: self._draw(step, values))

    def sync(self) -> FileMark:
        """Sync the finished flights to the disk; returns the file's mark.

        Raises:
            OSError: for example, the disk is full; unwritten lines are kept for the next time.
        """
        self._episodes.sync()
        if self._curves is not None:
            self._try(self._curves.flush)
        return self._episodes.mark

    def summary(self, summary: Summary) -> None:
        """Write the summary of the training."""
        write_record(self._run / "summary.json", summary)

    def close(self) -> None:
        """Write out what is buffered."""
        for file in (self._progress, self._episodes):
            self._try(file.write)
            file.close()
        if self._curves is not None:
            self._try(self._curves.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _draw(self, step: int, values: Mapping[str, float]) -> None:
        if self._curves is None:
            # Imported here, since it loads torch, and an evaluation draws no curves.
            from torch.utils.tensorboard.writer import SummaryWriter

            self._curves = SummaryWriter(log_dir=str(self._run / "tensorboard"), purge_step=self._flown + 1)
        for name, value in values.items():
            self._curves.add_scalar(name, value, step)
        self._flown = step

    def _try(self, write: Callable[[], None]) -> None:
        """Write a record whose loss must not end a training."""
        try:
            write()
        except OSError as error:
            if not self._failing:
                _log.warning("can't write records of the training, continuing without: %s", error)
            self._failing = True
            self._give_up_curves()
        else:
            self._failing = False

    def _give_up_curves(self) -> None:
        """TensorBoard's writer is of no use after an error; the next point opens another."""
        if self._curves is not None:
            with contextlib.suppress(OSError):
                self._curves.close()
            self._curves = None


def write_record(path: Path, record: Summary | Evaluation | GridEvaluation) -> None:
    """Write a record as a file of its own, whole or not at all."""
    with whole_file(path) as aside:
        aside.write_bytes(msgspec.json.format(msgspec.json.encode(record)) + b"\n")


def _add_line(file: AppendOnlyFile, record: Progress | Episode) -> None:
    file.add(msgspec.json.encode(record) + b"\n")


def _length_of(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0
