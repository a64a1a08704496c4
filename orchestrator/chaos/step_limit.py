"""A limit on the steps of a training, so that even a fast training does not end before its faults.

The training waits between two steps, and its result does not depend on how long.
"""

from protocol.failpoint import Failpoints


class StepLimit:
    """The present limit; there is none at first."""

    def __init__(self, failpoints: Failpoints) -> None:
        self._failpoints = failpoints
        self._place: str | None = None

    def move(self, step: int) -> None:
        """Move the limit to a step that the training has not passed."""
        place = f"step-{step}"
        if place == self._place:
            return
        self._failpoints.hold(place)
        # An order to do nothing: once it is used up, the training has reached the step.
        self._failpoints.order(place, "wait 0")
        self.lift()
        self._place = place

    def lift(self) -> None:
        """Remove the limit."""
        if self._place is not None:
            self._failpoints.cancel(self._place)
            self._failpoints.release(self._place)
            self._place = None

    @property
    def is_reached(self) -> bool:
        """Whether the training has reached the limit."""
        return self._place is not None and not self._failpoints.is_pending(self._place)
