"""Places where a process can be told to die or to wait, so that crashes can be rehearsed at the worst of moments.

Off unless `VANTAGE_FAILPOINTS` names a directory when the process starts. There a file that is called like a place says
what happens at it, once: `kill` ends the process as SIGKILL does, `wait SECONDS` holds it up. A file `PLACE.hold` has
every process that gets there wait for as long as the file is there, and the process whose number it contains runs.
"""

import contextlib
import os
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

from protocol.artifact import whole_file
from protocol.errors import InvalidInput

LOOK_EVERY = 0.02
"""Seconds between two looks of a process that is held."""
VARIABLE = "VANTAGE_FAILPOINTS"

Failpoint: TypeAlias = Callable[[str], None]
"""Called with the name of the place that was reached."""


def no_failpoint(_place: str) -> None:
    """What production calls."""


def failpoint_of(environment: Mapping[str, str]) -> Failpoint:
    """The failpoints that an environment asks for; without any, a function that does nothing."""
    directory = environment.get(VARIABLE)
    return Failpoints(Path(directory)).reach if directory else no_failpoint


class Failpoints:
    """Orders for places, each a file that is used up by the first process that gets there; and places that are held."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def order(self, place: str, what: str) -> None:
        """Have the next process that reaches `place` do `what`: `kill`, or `wait SECONDS`."""
        _parse(what)
        with whole_file(self._directory / place) as aside:
            aside.write_text(what, encoding="utf-8")

    def is_pending(self, place: str) -> bool:
        """Whether nobody got there yet."""
        return (self._directory / place).exists()

    def cancel(self, place: str) -> None:
        """Take an order back that nobody has carried out."""
        (self._directory / place).unlink(missing_ok=True)

    def hold(self, place: str) -> None:
        """Have every process that reaches `place` wait there until it is released, or until we have ended."""
        with whole_file(self._holding(place)) as aside:
            aside.write_text(str(os.getpid()), encoding="utf-8")

    def release(self, place: str) -> None:
        """Let go who waits at a place, and hold nobody there any more."""
        self._holding(place).unlink(missing_ok=True)

    def reach(self, place: str) -> None:
        """Carry out what is ordered for the place, if anything is; then wait for as long as the place is held."""
        taken = self._directory / f".{place}.taken.{os.getpid()}"
        with contextlib.suppress(FileNotFoundError):
            (self._directory / place).rename(taken)
            what = taken.read_text(encoding="utf-8")
            taken.unlink()
            _carry_out(_parse(what))
        while self._is_held(place):
            time.sleep(LOOK_EVERY)

    def _is_held(self, place: str) -> bool:
        try:
            return _exists(int(self._holding(place).read_text(encoding="utf-8")))
        except FileNotFoundError:
            return False

    def _holding(self, place: str) -> Path:
        return self._directory / f"{place}.hold"


def _parse(what: str) -> float | None:
    """Seconds to wait; None to die."""
    if what == "kill":
        return None
    word, _, seconds = what.partition(" ")
    if word == "wait":
        with contextlib.suppress(ValueError):
            return float(seconds)
    raise InvalidInput(f"a failpoint is told 'kill' or 'wait SECONDS', not {what!r}")


def _carry_out(wait: float | None) -> None:
    if wait is None:
        os.kill(os.getpid(), signal.SIGKILL)
    else:
        time.sleep(wait)


def _exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
