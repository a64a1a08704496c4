"""An arm that reaches: the shoulder girdle, two-bone inverse kinematics, and the twist along the arm."""

from typing import NamedTuple

import numpy as np

from protocol.arrays import Float64Array
from protocol.scene import Arm
from render_worker.rotation import cross, frame, rotation, rotation_vector, shortest_turn

STRAIGHTEST = 0.995
"""Share of its length that an arm reaches at most: a fully straight one has no plane to bend in."""

UPPER_SHARE = 0.535
"""Of an arm's length that is above the elbow; in no identity more than 0.01 more or less."""

_GIRDLE_SHARE = 0.22
"""Share of the upper arm's turn that the collarbone and shoulder blade take over."""

_BACKWARDS = np.array([-0.5, 0.0, -1.0])
"""Where an elbow hangs: down, and to the back where the arm itself hangs down."""


class RestArm(NamedTuple):
    """Where an arm's bones start at rest, in the body frame, metres; `side` is 1 for the left and -1 for the right."""

    shoulder: Float64Array
    elbow: Float64Array
    wrist: Float64Array
    side: int

    @property
    def length(self) -> float:
        """From shoulder to wrist along the bones."""
        return float(np.linalg.norm(self.elbow - self.shoulder) + np.linalg.norm(self.wrist - self.elbow))


class PosedArm(NamedTuple):
    """Rotations (3, 3) of the bones from rest, in the body frame.

    Attributes:
        girdle: of the collarbone and what hangs on it.
        upper_twist: of the half of the upper arm next to the shoulder.
        upper: of the half next to the elbow.
        lower: of the forearm and hand.
    """

    girdle: Float64Array
    upper_twist: Float64Array
    upper: Float64Array
    lower: Float64Array


def pose_arm(rest: RestArm, arm: Arm) -> PosedArm:
    """Turn an arm's bones so that its wrist comes to `arm.wrist`, or as near as its length allows."""
    upper_length = float(np.linalg.norm(rest.elbow - rest.shoulder))
    lower_length = float(np.linalg.norm(rest.wrist - rest.elbow))
    target = _within_reach(np.asarray(arm.wrist, float) * rest.length, upper_length, lower_length)
    girdle = _girdle(rest, target)
    elbow = _elbow(target, upper_length, lower_length, _hanging(target, arm.swivel, rest.side))
    upper = _turn(rest.elbow - rest.shoulder, _hinge(rest), elbow, cross(elbow, target))
    lower = _turn(rest.wrist - rest.elbow, _hinge(rest), target - elbow, cross(elbow, target))
    return PosedArm(girdle, _without_half_the_twist(upper, girdle, rest.elbow - rest.shoulder), upper, lower)


def elbow_of(arm: Arm, side: int) -> Float64Array:
    """The elbow (3,) of an arm of usual proportions, as `Arm.wrist`; `side` is 1 for the left and -1 for the right."""
    target = _within_reach(np.asarray(arm.wrist, float), UPPER_SHARE, 1 - UPPER_SHARE)
    return _elbow(target, UPPER_SHARE, 1 - UPPER_SHARE, _hanging(target, arm.swivel, side))


def _girdle(rest: RestArm, reach: Float64Array) -> Float64Array:
    """The collarbone follows the arm a little, more when the arm goes up than when it hangs."""
    return rotation(_GIRDLE_SHARE * rotation_vector(shortest_turn(rest.elbow - rest.shoulder, reach)))


def _within_reach(target: Float64Array, upper: float, lower: float) -> Float64Array:
    distance = float(np.linalg.norm(target))
    nearest, farthest = abs(upper - lower) * 1.02 + 1e-3, (upper + lower) * STRAIGHTEST
    direction = target / distance if distance > 1e-9 else np.array([0.0, 0.0, -1.0])
    return direction * np.clip(distance, nearest, farthest)


def _elbow(target: Float64Array, upper: float, lower: float, pole: Float64Array) -> Float64Array:
    """The elbow, from the shoulder, by the law of cosines; it lies on the side of the arm that `pole` points to."""
    distance = float(np.linalg.norm(target))
    along = (upper**2 - lower**2 + distance**2) / (2 * distance)
    aside = np.sqrt(max(upper**2 - along**2, 0.0))
    return along * target / distance + aside * pole


def _hanging(target: Float64Array, swivel: float, side: int) -> Float64Array:
    """Unit vector across the arm to which the elbow hangs, turned about the arm outwards by `swivel`."""
    axis = target / np.linalg.norm(target)
    pole = _BACKWARDS - (_BACKWARDS @ axis) * axis
    if np.linalg.norm(pole) < 1e-6:
        pole = cross(axis, np.array([0.0, 1.0, 0.0]))
    pole /= np.linalg.norm(pole)
    return rotation(side * swivel * axis) @ pole


def _hinge(rest: RestArm) -> Float64Array:
    """The elbow's axis at rest: the forearm is bent there in every identity."""
    return cross(rest.elbow - rest.shoulder, rest.wrist - rest.elbow)


def _turn(rest_along: Float64Array, rest_hinge: Float64Array, along: Float64Array, hinge: Float64Array) -> Float64Array:
    return frame(along, hinge) @ frame(rest_along, rest_hinge).T


def _without_half_the_twist(upper: Float64Array, girdle: Float64Array, along: Float64Array) -> Float64Array:
    """The upper arm's turn with half of its twist against the shoulder: all of it is more than skin can follow."""
    carried = girdle @ along
    swung = shortest_turn(carried, upper @ along) @ girdle
    twist = rotation_vector(upper @ swung.T)
    return rotation(0.5 * twist) @ swung
