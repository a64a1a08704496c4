"""The steps of a training at any moment, by its `progress.jsonl`; prefill and training are counted together."""

import math
from pathlib import Path

import msgspec
from msgspec import Struct

from orchestrator.run.json_lines import Follower
from protocol.records import Progress
from protocol.text import UNDECODABLE

LONGEST_GUESS = 1.0
"""Seconds after its last line for which a training is assumed to continue at its throughput; it writes one a second."""


class Mark(Struct, frozen=True):
    """The number of steps at a time, in seconds of the machine's monotonic clock."""

    time: float
    step: int


class ProgressLog:
    """The progress so far; each `read` adds to it."""

    def __init__(self, path: Path) -> None:
        self._follower = Follower(path)
        self._prefill = 0
        self._throughputs: list[float] = []
        self.marks: list[Mark] = []
        self.last: Progress | None = None

    def read(self) -> None:
        """Read the lines since the last call; a line that a kill has cut off is skipped."""
        for line in self._follower.new_lines():
            try:
                self._enter(msgspec.json.decode(line, type=Progress))
            except UNDECODABLE:
                continue

    @property
    def step(self) -> int:
        """Steps at the last line."""
        return self.marks[-1].step if self.marks else 0

    @property
    def is_done(self) -> bool:
        """Whether all steps are done."""
        return self.last is not None and self.last.phase == "done"

    def reached(self, time: float) -> int:
        """Steps at a time: those of the line before it, and what the throughput adds since then."""
        before = [index for index, mark in enumerate(self.marks) if mark.time <= time]
        if not before:
            return 0
        mark, throughput = self.marks[before[-1]], self._throughputs[before[-1]]
        return mark.step + math.ceil(throughput * min(time - mark.time, LONGEST_GUESS))

    def first_beyond(self, step: int, time: float) -> Mark | None:
        """The first line after `time` with more than `step` steps, or the last line of a finished training."""
        later = (mark for mark in self.marks if mark.time > time)
        beyond = next((mark for mark in later if mark.step > step), None)
        return beyond or (self.marks[-1] if self.is_done else None)

    def lowest_after(self, time: float) -> int | None:
        """The fewest steps of any line after `time`: where a training was resumed."""
        return min((mark.step for mark in self.marks if mark.time > time), default=None)

    def _enter(self, progress: Progress) -> None:
        if progress.phase == "prefill":
            self._prefill = max(self._prefill, progress.step)
        flown = progress.step if progress.phase == "prefill" else self._prefill + progress.step
        self.last = progress
        self.marks.append(Mark(progress.time if progress.steady is None else progress.steady, flown))
        self._throughputs.append(progress.steps_per_second)
