"""A restart, as it is written down."""

from collections import Counter
from collections.abc import Iterable

from msgspec import Struct


class Restart(Struct, frozen=True, kw_only=True):
    """A line of `restarts.jsonl`.

    Attributes:
        time: seconds since 1970.
        process: its name, such as `render-0`.
        reason: why, in a sentence.
        planned: whether it was replaced on purpose, for its memory or its requests.
    """

    time: float
    process: str
    reason: str
    planned: bool = False


def count_restarts(restarts: Iterable[Restart], *, planned: bool = False) -> dict[str, int]:
    """How often each process was started again that was."""
    counted = Counter(restart.process for restart in restarts if restart.planned is planned)
    return dict(sorted(counted.items()))
