"""The step that a training does not go beyond, so that it is not over before its faults, however fast it is.

The training waits between two steps, and nothing that it comes to depends on how long.
"""

from protocol.failpoint import Failpoints


class StepLimit:
    """At most one step at a time; none at first."""

    def __init__(self, failpoints: Failpoints) -> None:
        self._failpoints = failpoints
        self._place: str | None = None

    def move(self, step: int) -> None:
        """Hold the training at this step, which it has not gone beyond, and no longer at the one before."""
        place = f"step-{step}"
        if place == self._place:
            return
        self._failpoints.hold(place)
        # An order to do nothing: when it is used up, somebody is there.
        self._failpoints.order(place, "wait 0")
        self.lift()
        self._place = place

    def lift(self) -> None:
        """Let the training go on to its end."""
        if self._place is not None:
            self._failpoints.cancel(self._place)
            self._failpoints.release(self._place)
            self._place = None

    @property
    def is_reached(self) -> bool:
        """Whether the training has come to the limit since it is there."""
        return self._place is not None and not self._failpoints.is_pending(self._place)
