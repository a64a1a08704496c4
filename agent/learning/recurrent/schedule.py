"""Settings that change over a training."""


def linear_schedule(steps: int, *, first: float, last: float, over: int) -> float:
    """A setting after so many environment steps: evenly from `first` to `last`, `over` so many, and then `last`."""
    return first + (last - first) * min(1.0, steps / over)
