"""How the work on a run ended, as its orchestrator recorded it; a killed orchestrator records nothing."""

from typing import Literal, TypeAlias

from msgspec import Struct

from protocol.errors import Interrupted, VantageError
from protocol.system.refusal import SYSTEM_ERRORS, sentence

Outcome: TypeAlias = Literal["finished", "stopped", "failed"]


class Ending(Struct, frozen=True, kw_only=True):
    """The content of `ending.json`.

    Attributes:
        time: seconds since 1970, by the wall clock; for display.
        outcome: `finished` when all that was planned is done, `stopped` on request, `failed` by an error.
        reason: why it was stopped or failed, in a sentence.
    """

    time: float
    outcome: Outcome
    reason: str | None = None


def ending_by(error: BaseException, time: float) -> Ending:
    """The ending of work that an error ended, at a time in seconds since 1970."""
    stopped = isinstance(error, Interrupted | KeyboardInterrupt)
    return Ending(time=time, outcome="stopped" if stopped else "failed", reason=_reason(error) or None)


def _reason(error: BaseException) -> str:
    if isinstance(error, VantageError | KeyboardInterrupt):
        return str(error)
    return sentence(error) if isinstance(error, SYSTEM_ERRORS) else f"{type(error).__name__}: {error}"
