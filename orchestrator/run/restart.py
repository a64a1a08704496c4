"""The record of a restart."""

from collections import Counter
from collections.abc import Iterable

from msgspec import Struct


class Restart(Struct, frozen=True, kw_only=True):
    """A line of `restarts.jsonl`.

    Attributes:
        time: seconds since 1970.
        process: the process's name, such as `render-0`.
        reason: why it was restarted, in a sentence.
        planned: whether it was replaced because it had reached a limit of memory or requests.
    """

    time: float
    process: str
    reason: str
    planned: bool = False


def count_restarts(restarts: Iterable[Restart], *, planned: bool = False) -> dict[str, int]:
    """How often each process was restarted; processes without a restart are left out."""
    counted = Counter(restart.process for restart in restarts if restart.planned is planned)
    return dict(sorted(counted.items()))
