"""How the work on a run ended, as its orchestrator wrote it down; one that was killed wrote nothing."""

from typing import Literal, TypeAlias

from msgspec import Struct

from protocol.errors import Interrupted, VantageError
from protocol.system.refusal import SYSTEM_ERRORS, sentence

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


def ending_by(error: BaseException, time: float) -> Ending:
    """How work ended that an error ended before all was done, at a time in seconds since 1970."""
    stopped = isinstance(error, Interrupted | KeyboardInterrupt)
    return Ending(time=time, outcome="stopped" if stopped else "failed", reason=_reason(error) or None)


def _reason(error: BaseException) -> str:
    if isinstance(error, VantageError | KeyboardInterrupt):
        return str(error)
    return sentence(error) if isinstance(error, SYSTEM_ERRORS) else f"{type(error).__name__}: {error}"
