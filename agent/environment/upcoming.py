"""The episode that begins next, taken off before a flight ends, so that its first picture is there by then.

A first picture takes many times as long as any other: a scene is staged, and the person is searched for. All that it
shows follows from the episode's number; so it may be asked for at any time, and is the same.
"""

from collections.abc import Callable
from typing import Any, TypeAlias

from agent.environment.looking import Looking
from protocol.errors import CallFailed

Begin: TypeAlias = Callable[[int], Looking]
"""Takes off the episode of a number and starts its first picture."""


class Upcoming:
    """Holds one episode that was taken off ahead of time."""

    def __init__(self) -> None:
        self._number = -1
        self._prepared: Looking | None = None

    def prepare(self, number: int, begin: Begin) -> None:
        """Take off an episode ahead of time, unless that is done. Where it can't be, it is taken off in its time."""
        if self._number == number and self._prepared is not None:
            return
        try:
            self._number, self._prepared = number, begin(number)
        except CallFailed:
            self._prepared = None

    def take(self, number: int, begin: Begin) -> Looking:
        """The episode of a number, as prepared or anew; whatever was prepared is given away once.

        Raises:
            CallFailed: no scene could be had.
        """
        prepared, self._prepared = self._prepared, None
        return prepared if prepared is not None and self._number == number else begin(number)

    def forget(self) -> None:
        """What was prepared is of no use any more: the numbers mean other episodes."""
        self._prepared = None

    def __deepcopy__(self, memo: dict[int, Any]) -> "Upcoming":
        # A picture under way can't be copied, and the copy can ask for it again.
        return Upcoming()
