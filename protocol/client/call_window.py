"""How many calls a client gives a worker at once."""

import math


class CallWindow:
    """Unbounded until the worker says that it is overloaded; from then on it follows what the worker takes.

    Attributes:
        size: the number of calls that the worker may hold.
    """

    def __init__(self) -> None:
        self.size = math.inf

    def shrink(self, held: int) -> None:
        """The worker refused a call while it held this many others."""
        self.size = max(1.0, held)

    def grow(self) -> None:
        """The worker answered a call. The window grows by one each time that all of it was answered."""
        self.size += 1 / self.size
