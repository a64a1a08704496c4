"""Seconds that each stage of a frame's way takes."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

Clock = Callable[[], float]


class Stopwatch:
    """Adds up seconds by stage.

    Attributes:
        seconds: of each stage so far.
    """

    def __init__(self, clock: Clock) -> None:
        self.seconds: dict[str, float] = {}
        self._clock = clock

    @contextmanager
    def stage(self, name: str) -> Generator[None]:
        """Count the time until the block's end to this stage."""
        start = self._clock()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + self._clock() - start
