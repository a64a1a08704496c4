"""What the estimated joints tell of a person: where they are, where they face, which hand they offer.

All of it is estimated. Positions are in the world frame, in metres.
"""

import math

import numpy as np
from msgspec import Struct

from protocol.arrays import BoolArray, Float64Array
from protocol.camera import Vector3
from protocol.skeleton import Joint

_SIDES = ((Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER), (Joint.LEFT_HIP, Joint.RIGHT_HIP))
_TRUNK = (Joint.NECK, Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER, Joint.LEFT_HIP, Joint.RIGHT_HIP)
_ARMS = ((Joint.LEFT_SHOULDER, Joint.LEFT_WRIST), (Joint.RIGHT_SHOULDER, Joint.RIGHT_WRIST))

OFFERED_AHEAD = 0.25
"""Metres by which a hand that is held out is in front of its shoulder."""


_NO_LENGTH = 1e-6
"""Metres; a shorter way across a body has no direction."""


class Person(Struct, frozen=True, eq=False):
    """Estimated joints.

    Attributes:
        joints: (18, 3).
        seen: (18,) which of them were ever seen; the others mean nothing.
    """

    joints: Float64Array
    seen: BoolArray

    @property
    def place(self) -> tuple[float, float] | None:
        """The middle of the trunk, seen from above; None before a part of it was seen."""
        trunk = [joint for joint in _TRUNK if self.seen[joint]]
        if not trunk:
            return None
        x, y = self.joints[trunk, :2].mean(axis=0).tolist()
        return x, y

    @property
    def facing(self) -> tuple[float, float] | None:
        """The direction to their front, of length 1; None before both shoulders or both hips were seen."""
        sides = [self.joints[left] - self.joints[right] for left, right in _SIDES if self._both(left, right)]
        across_x, across_y, _ = np.sum(sides, axis=0).tolist() if sides else (0.0, 0.0, 0.0)
        length = math.hypot(across_x, across_y)
        # The front is a quarter turn clockwise from the way to the left, seen from above.
        return None if length < _NO_LENGTH else (across_y / length, -across_x / length)

    def front_point(self, distance: float, height: float) -> Vector3 | None:
        """The point so far in front of them, at a height above the ground; None before it is known."""
        if self.place is None or self.facing is None:
            return None
        (x, y), (ahead_x, ahead_y) = self.place, self.facing
        return x + distance * ahead_x, y + distance * ahead_y, height

    def handover_wrist(self, drone: Vector3) -> Joint:
        """The wrist held out farthest in front of its shoulder; if none is held out, that nearer to a drone.

        A wrist that was never seen is taken last.
        """
        ahead = {wrist: self._ahead(shoulder, wrist) for shoulder, wrist in _ARMS}
        offered = max(ahead, key=lambda wrist: ahead[wrist])
        if ahead[offered] >= OFFERED_AHEAD:
            return offered
        away = {wrist: float(np.linalg.norm(self.joints[wrist] - drone)) for wrist in ahead}
        return min(away, key=lambda wrist: (not self.seen[wrist], away[wrist]))

    def _ahead(self, shoulder: Joint, wrist: Joint) -> float:
        """Metres by which a wrist is in front of its shoulder; less than nothing while that is not known."""
        if self.facing is None or not self._both(shoulder, wrist):
            return -np.inf
        return float((self.joints[wrist, :2] - self.joints[shoulder, :2]) @ self.facing)

    def _both(self, one: Joint, other: Joint) -> bool:
        return bool(self.seen[one] and self.seen[other])
