"""The throughput of a training over the last few seconds."""

from collections import deque
from collections.abc import Callable

_WINDOW = 10.0
"""Seconds."""


class Throughput:
    """Counts steps against a clock in seconds.

    Args:
        done: steps done before, in unknown time.
    """

    def __init__(self, clock: Callable[[], float], done: int = 0) -> None:
        self._clock = clock
        self._marks = deque([(clock(), done)])

    def reached(self, step: int) -> None:
        """Record the number of steps done in all."""
        now = self._clock()
        self._marks.append((now, step))
        while len(self._marks) > 2 and self._marks[1][0] <= now - _WINDOW:
            self._marks.popleft()

    @property
    def steps_per_second(self) -> float:
        """Zero before the first step."""
        (begin, first), (end, last) = self._marks[0], self._marks[-1]
        return (last - first) / (end - begin) if end > begin else 0.0
