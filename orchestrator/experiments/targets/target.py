"""A target: a figure and its bounds."""

from msgspec import Struct

NOISE, STEREO = "none", "d435i"
"""Targets are without depth noise unless they name one."""


class Target(Struct, frozen=True, kw_only=True):
    """A figure, and the bounds that it has to be within."""

    words: str
    value: float
    low: float
    high: float = 1.0
    noise: str = NOISE

    @property
    def met(self) -> bool:
        """Whether it is within them."""
        return self.low <= self.value <= self.high
