"""How far a training was at any moment, as its `progress.jsonl` tells; prefill and training are counted together."""

import math
from pathlib import Path

import msgspec
from msgspec import Struct

from orchestrator.run.json_lines import Follower
from protocol.records import Progress
from protocol.text import UNDECODABLE

LONGEST_GUESS = 1.0
"""Seconds past its last line for which a training is taken to have gone on at its pace; it writes a line a second."""


class Mark(Struct, frozen=True):
    """So many steps had been flown at that time, in seconds of the machine's monotonic clock."""

    time: float
    step: int


class ProgressLog:
    """Grows with each `read`."""

    def __init__(self, path: Path) -> None:
        self._follower = Follower(path)
        self._prefill = 0
        self._paces: list[float] = []
        self.marks: list[Mark] = []
        self.last: Progress | None = None

    def read(self) -> None:
        """Take in what was written since the last look; a line that a kill has cut off is passed over."""
        for line in self._follower.new_lines():
            try:
                self._enter(msgspec.json.decode(line, type=Progress))
            except UNDECODABLE:
                continue

    @property
    def step(self) -> int:
        """Steps flown, as last heard of."""
        return self.marks[-1].step if self.marks else 0

    @property
    def is_done(self) -> bool:
        """Whether all steps are flown."""
        return self.last is not None and self.last.phase == "done"

    def reached(self, time: float) -> int:
        """Steps flown at a time: what the line before it says, and what the pace since then adds."""
        before = [index for index, mark in enumerate(self.marks) if mark.time <= time]
        if not before:
            return 0
        mark, pace = self.marks[before[-1]], self._paces[before[-1]]
        return mark.step + math.ceil(pace * min(time - mark.time, LONGEST_GUESS))

    def first_beyond(self, step: int, time: float) -> Mark | None:
        """The first line after `time` that tells of more than `step` steps, or of the end."""
        later = (mark for mark in self.marks if mark.time > time)
        beyond = next((mark for mark in later if mark.step > step), None)
        return beyond or (self.marks[-1] if self.is_done else None)

    def lowest_after(self, time: float) -> int | None:
        """The fewest steps that any line after `time` tells of: where a training was taken up again."""
        return min((mark.step for mark in self.marks if mark.time > time), default=None)

    def _enter(self, progress: Progress) -> None:
        if progress.phase == "prefill":
            self._prefill = max(self._prefill, progress.step)
        flown = progress.step if progress.phase == "prefill" else self._prefill + progress.step
        self.last = progress
        self.marks.append(Mark(progress.time if progress.steady is None else progress.steady, flown))
        self._paces.append(progress.steps_per_second)
