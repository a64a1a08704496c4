"""One figure, and what it is held against."""

from msgspec import Struct

NOISE, STEREO = "none", "d435i"
"""Targets are set without depth noise unless they say with which."""


class Target(Struct, frozen=True, kw_only=True):
    """One figure and the bounds that it is to keep within."""

    words: str
    value: float
    low: float
    high: float = 1.0
    noise: str = NOISE

    @property
    def met(self) -> bool:
        """Whether it does."""
        return self.low <= self.value <= self.high
