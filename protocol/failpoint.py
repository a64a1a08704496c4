"""Places in the code where a process can be told to die or to wait, to rehearse crashes at the worst moments.

They are off unless `VANTAGE_FAILPOINTS` names a directory when the process starts. A file in it with the name of a
place says what happens there, once: `kill` ends the process by SIGKILL, `wait SECONDS` delays it. While a file
`PLACE.hold` exists, and the process whose pid it contains runs, every process that reaches the place waits.
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

CHECK_EVERY = 0.02
"""Seconds between two checks of a process that is held."""
VARIABLE = "VANTAGE_FAILPOINTS"

Failpoint: TypeAlias = Callable[[str], None]
"""Called with the name of a place when that is reached."""


def no_failpoint(_place: str) -> None:
    """Does nothing; the failpoint of production."""


def failpoint_of(environment: Mapping[str, str]) -> Failpoint:
    """The failpoints of an environment; `no_failpoint` if it names no directory."""
    directory = environment.get(VARIABLE)
    return Failpoints(Path(directory)).reach if directory else no_failpoint


class Failpoints:
    """Orders for places, each a file that the first process to reach the place removes; and places that are held."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def order(self, place: str, what: str) -> None:
        """Order the next process that reaches `place` to do `what`: `kill`, or `wait SECONDS`."""
        _parse(what)
        with whole_file(self._directory / place) as aside:
            aside.write_text(what, encoding="utf-8")

    def is_pending(self, place: str) -> bool:
        """Whether no process has carried out the order yet."""
        return (self._directory / place).exists()

    def cancel(self, place: str) -> None:
        """Remove an order that no process has carried out."""
        (self._directory / place).unlink(missing_ok=True)

    def hold(self, place: str) -> None:
        """Make every process that reaches `place` wait there until it is released, or until this process has ended."""
        with whole_file(self._holding(place)) as aside:
            aside.write_text(str(os.getpid()), encoding="utf-8")

    def release(self, place: str) -> None:
        """Release the processes that wait at a place, and hold no more there."""
        self._holding(place).unlink(missing_ok=True)

    def reach(self, place: str) -> None:
        """Carry out the order for the place, if there is one; then wait as long as the place is held."""
        taken = self._directory / f".{place}.taken.{os.getpid()}"
        with contextlib.suppress(FileNotFoundError):
            (self._directory / place).rename(taken)
            what = taken.read_text(encoding="utf-8")
            taken.unlink()
            _carry_out(_parse(what))
        while self._is_held(place):
            time.sleep(CHECK_EVERY)

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
