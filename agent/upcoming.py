"""The episode that begins next, taken off before a flight ends, so that its first picture is there by then.

A first picture takes many times as long as any other: a scene is staged, and the whole frame is looked at. All that it
shows follows from the episode's number; so it may be asked for at any time, and is the same.
"""

from collections.abc import Callable

from agent.looking import Looking
from protocol.errors import CallFailed


class Upcoming:
    """Takes off episodes by their numbers, one of them ahead of time.

    Args:
        begin: takes off the episode of a number and starts its first picture.
    """

    def __init__(self, begin: Callable[[int], Looking]) -> None:
        self._begin = begin
        self._number = -1
        self._prepared: Looking | None = None

    def prepare(self, number: int) -> None:
        """Take off an episode ahead of time, unless that is done. Where it can't be, it is taken off in its time."""
        if self._number == number and self._prepared is not None:
            return
        try:
            self._number, self._prepared = number, self._begin(number)
        except CallFailed:
            self._prepared = None

    def take(self, number: int) -> Looking:
        """The episode of a number, as prepared or anew; whatever was prepared is given away once.

        Raises:
            CallFailed: no scene could be had.
        """
        prepared, self._prepared = self._prepared, None
        return prepared if prepared is not None and self._number == number else self._begin(number)

    def forget(self) -> None:
        """What was prepared is of no use any more: the numbers mean other episodes."""
        self._prepared = None
