"""How the work on a run ended, as its orchestrator wrote it down; one that was killed wrote nothing."""

from typing import Literal, TypeAlias

from msgspec import Struct

Outcome: TypeAlias = Literal["finished", "stopped", "failed"]


class Ending(Struct, frozen=True, kw_only=True):
    """What `ending.json` says.

    Attributes:
        time: seconds since 1970, for people.
        outcome: all that was planned is done, somebody stopped it, or it could not go on.
        reason: why it ended before that, in a sentence.
    """

    time: float
    outcome: Outcome
    reason: str | None = None
