"""The next episode, begun before a flight ends, so that its first estimate is there by then.

A first estimate takes many times as long as any other: a scene is staged, and the person is searched for. It follows
from the episode's number alone; so it may be requested at any time, and is the same.
"""

from collections.abc import Callable
from typing import Any, TypeAlias

from agent.environment.pending_flight import PendingFlight
from protocol.errors import CallFailed

Begin: TypeAlias = Callable[[int], PendingFlight]
"""Begins the episode of a number and requests its first estimate."""


class EpisodePrefetch:
    """Holds one episode that was begun ahead of time."""

    def __init__(self) -> None:
        self._number = -1
        self._prepared: PendingFlight | None = None

    def prepare(self, number: int, begin: Begin) -> None:
        """Begin an episode ahead of time, unless that is done. If no worker answers, `take` begins it."""
        if self._number == number and self._prepared is not None:
            return
        try:
            self._number, self._prepared = number, begin(number)
        except CallFailed:
            self._prepared = None

    def take(self, number: int, begin: Begin) -> PendingFlight:
        """The episode of a number, as prepared or begun now; a prepared episode is given away once.

        Raises:
            CallFailed: no scene came.
        """
        prepared, self._prepared = self._prepared, None
        return prepared if prepared is not None and self._number == number else begin(number)

    def forget(self) -> None:
        """Drop the prepared episode: the numbers mean other episodes from now on."""
        self._prepared = None

    def __deepcopy__(self, memo: dict[int, Any]) -> "EpisodePrefetch":
        # A request under way can't be copied, and the copy can repeat it.
        return EpisodePrefetch()
