"""What a training writes down as it goes, for people and for the orchestrator; nothing in it is needed to go on."""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, Self

import msgspec

from protocol.artifact import whole_file
from protocol.records import Episode, Evaluation, Progress, Summary

if TYPE_CHECKING:
    from torch.utils.tensorboard.writer import SummaryWriter


class Journal:
    """The records of a run directory: progress and episodes by the line, curves, and a summary at the end."""

    def __init__(self, run: Path) -> None:
        self._run = run
        self._progress = (run / "progress.jsonl").open("ab")
        self._episodes = (run / "episodes.jsonl").open("ab")
        self._curves: SummaryWriter | None = None

    def progress(self, progress: Progress) -> None:
        """Add a line on where the training stands; readers see it, and all episodes so far, at once."""
        _add_line(self._progress, progress)
        self._progress.flush()
        self._episodes.flush()

    def episode(self, episode: Episode) -> None:
        """Add a line for a finished flight; it is written with the next progress."""
        _add_line(self._episodes, episode)

    def curves(self, step: int, values: Mapping[str, float]) -> None:
        """Add a point to each of TensorBoard's curves."""
        if self._curves is None:
            # Only here, since it loads torch, and an evaluation draws no curves.
            from torch.utils.tensorboard.writer import SummaryWriter

            self._curves = SummaryWriter(log_dir=str(self._run / "tensorboard"))
        for name, value in values.items():
            self._curves.add_scalar(name, value, step)

    def summary(self, summary: Summary) -> None:
        """Write how the training ended."""
        write_record(self._run / "summary.json", summary)

    def close(self) -> None:
        """Write out what is buffered."""
        self._progress.close()
        self._episodes.close()
        if self._curves is not None:
            self._curves.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def write_record(path: Path, record: Summary | Evaluation) -> None:
    """Write a record as a file of its own, whole or not at all."""
    with whole_file(path) as aside:
        aside.write_bytes(msgspec.json.format(msgspec.json.encode(record)) + b"\n")


def _add_line(file: IO[bytes], record: Progress | Episode) -> None:
    file.write(msgspec.json.encode(record) + b"\n")
