"""Who has worked on a run, and how each time ended: `work.jsonl`, a line when it begins and one when it ends."""

import logging
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal, TypeAlias

from msgspec import Struct

from orchestrator.errors import HostNotTold, Interrupted
from orchestrator.json_lines import all_records, append_record
from protocol.errors import VantageError
from protocol.refusal import SYSTEM_ERRORS, reason, sentence

Job: TypeAlias = Literal["train", "resume", "evaluate"]
Ending: TypeAlias = Literal["done", "stopped", "failed"]

_log = logging.getLogger(__name__)


class Work(Struct, frozen=True, kw_only=True):
    """One time that an orchestrator worked on the run, at its beginning or its end.

    Attributes:
        time: seconds since 1970.
        ending: None at its beginning; a last line without is of one that was killed.
        seconds: that it took.
        reason: why it failed or was stopped.
    """

    job: Job
    time: float
    ending: Ending | None = None
    seconds: float = 0.0
    reason: str = ""


@contextmanager
def noted_work(
    path: Path, job: Job, clock: Callable[[], float] = time.monotonic, wall_clock: Callable[[], float] = time.time
) -> Generator[None]:
    """While inside, an orchestrator works; how that ends is written down, whatever ends it but a kill."""
    began = clock()
    _note(path, Work(job=job, time=wall_clock()))
    ending: Ending = "failed"
    why = ""
    try:
        yield
        ending = "done"
    except BaseException as error:
        ending, why = _ending_by(error)
        raise
    finally:
        _note(path, Work(job=job, time=wall_clock(), ending=ending, seconds=clock() - began, reason=why))


def all_work(path: Path) -> tuple[Work, ...]:
    """Every line so far; none of a run that an earlier version made."""
    return tuple(all_records(path, Work))


def _ending_by(error: BaseException) -> tuple[Ending, str]:
    if isinstance(error, HostNotTold):
        return "done", str(error)
    if isinstance(error, Interrupted | KeyboardInterrupt):
        return "stopped", str(error)
    if isinstance(error, VantageError):
        return "failed", str(error)
    return "failed", sentence(error) if isinstance(error, SYSTEM_ERRORS) else f"{type(error).__name__}: {error}"


def _note(path: Path, work: Work) -> None:
    try:
        append_record(path, work)
    except OSError as error:
        # On a full disk the work itself may still come to its end.
        _log.warning("that the run is worked on can't be written down: %s", reason(error))
