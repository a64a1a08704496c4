"""Poses to train on: joint angles over the joints' ranges, all of kind 0.

They keep out of every family of `pose_families`, which are there to be tested on: no hand above the head, no wrist on
the other side of the body, no knee bent as far as for squatting, kneeling or sitting.
"""

import math
from collections.abc import Callable

import numpy as np

from protocol.scene import Arm, BodyPose, Head, Leg, Trunk
from render_worker.clearance import is_clear
from render_worker.limbs import Range, elevation, hanging, inward, mirrored, on_side, reach, standing, uniform
from render_worker.posing import trunk_rotation

MOST_ELEVATION = math.radians(25)
"""Of a wrist above its shoulder, in the frame of the trunk: below the eyes."""

MOST_INWARD = 0.25
"""Of a wrist from its shoulder, in units of the arm's length: it stays on its own side of the body."""

MOST_KNEE = 0.9
"""Radians that a knee is bent: a crouch."""

MOST_HEAD_TURN = 1.2

_Legs = tuple[Leg, Leg]


def sample_wide_pose(random: np.random.Generator) -> BodyPose:
    """Draw one pose; as often left-handed as right-handed."""
    while True:
        pose = _PARTS[int(random.choice(len(_PARTS), p=_SHARES))](random)
        pose = mirrored(pose) if random.random() < 0.5 else pose
        if is_wide(pose):
            return pose


def is_wide(pose: BodyPose) -> bool:
    """Whether a pose keeps within the limits above, and its arms out of its trunk."""
    sides = (pose.left_arm, 1), (pose.right_arm, -1)
    return (
        all(elevation(arm) <= MOST_ELEVATION and inward(arm, side) <= MOST_INWARD for arm, side in sides)
        and all(leg.knee <= MOST_KNEE for leg in (pose.left_leg, pose.right_leg))
        and all(is_clear(arm, side) for arm, side in sides)
    )


def _arms_anywhere(random: np.random.Generator) -> BodyPose:
    arms = _any_arm(random), _any_arm(random)
    return _pose(arms, _stance(random), _head(random), _slight_turn(random))


def _holding_out(random: np.random.Generator) -> BodyPose:
    """One hand held out, seldom both: to the front or the side, level or low, near or far."""
    other = _held_out(random) if random.random() < 0.35 else _resting(random)
    trunk = Trunk(*uniform(random, (-0.1, 0.5), (-0.2, 0.2), (-0.4, 0.4)))
    return _pose((_held_out(random), other), _stance(random), _head(random), trunk)


def _bending(random: np.random.Generator) -> BodyPose:
    trunk = Trunk(*uniform(random, (0.3, 1.2), (-0.25, 0.25), (-0.4, 0.4)))
    left, right = (_towards_ground(_resting(random), trunk, side) for side in (1, -1))
    arms = _held_out(random) if random.random() < 0.5 else left, right
    return _pose(arms, _crouch(random, (0.0, 0.3)), _head(random), trunk)


def _leaning(random: np.random.Generator) -> BodyPose:
    trunk = Trunk(*uniform(random, (-0.2, 0.3), (-0.45, 0.45), (-0.7, 0.7)))
    arms = _any_arm(random) if random.random() < 0.5 else _resting(random), _resting(random)
    return _pose(arms, _stance(random), _head(random), trunk)


def _crouching(random: np.random.Generator) -> BodyPose:
    trunk = Trunk(*uniform(random, (0.1, 0.8), (-0.15, 0.15), (-0.3, 0.3)))
    other = _held_out(random) if random.random() < 0.5 else _resting(random)
    return _pose((_held_out(random), other), _crouch(random, (0.3, MOST_KNEE)), _head(random), trunk)


def _walking(random: np.random.Generator) -> BodyPose:
    """A step with the right leg ahead, and with it the left arm."""
    behind = Leg(*uniform(random, (-0.35, -0.1), (-0.05, 0.03), (0.1, 0.7)))
    ahead = Leg(*uniform(random, (0.2, 0.5), (-0.05, 0.03), (0.05, 0.25)))
    front = reach(random, out=(0, 25), up=(-75, -40), length=(0.75, 0.95))
    back = reach(random, out=(125, 160), up=(-80, -60), length=(0.92, 0.98))
    trunk = Trunk(*uniform(random, (-0.05, 0.25), (-0.05, 0.05), (-0.2, 0.05)))
    return _pose((front, back), (behind, ahead), _head(random), trunk)


def _looking_about(random: np.random.Generator) -> BodyPose:
    head = Head(*uniform(random, (-0.45, 0.65), (-MOST_HEAD_TURN, MOST_HEAD_TURN)))
    return _pose((_resting(random), _resting(random)), standing(random), head, _slight_turn(random))


_Part = Callable[[np.random.Generator], BodyPose]
_MIXTURE: tuple[tuple[_Part, float], ...] = (
    (_arms_anywhere, 0.2),
    (_holding_out, 0.25),
    (_bending, 0.15),
    (_leaning, 0.1),
    (_crouching, 0.1),
    (_walking, 0.1),
    (_looking_about, 0.1),
)
_PARTS = tuple(part for part, _ in _MIXTURE)
_SHARES = tuple(share for _, share in _MIXTURE)


def _pose(arms: tuple[Arm, Arm], legs: _Legs, head: Head, trunk: Trunk) -> BodyPose:
    """Of two arms as if both were on the left."""
    return BodyPose(0, on_side(arms[0], 1), on_side(arms[1], -1), *legs, head=head, trunk=trunk)


def _any_arm(random: np.random.Generator) -> Arm:
    if random.random() < 0.15:
        return reach(random, out=(110, 155), up=(-80, -40), length=(0.8, 0.98), swivel=(-0.2, 0.3))
    return reach(random, out=(-40, 110), up=(-80, 25), length=(0.5, 0.98), swivel=(-0.2, 0.8))


def _held_out(random: np.random.Generator) -> Arm:
    return reach(random, out=(-15, 105), up=(-65, 20), length=(0.55, 0.97), swivel=(0.0, 0.5))


def _resting(random: np.random.Generator) -> Arm:
    """An arm that hangs, straight or a little bent."""
    return hanging(random) if random.random() < 0.5 else _bent_a_little(random)


def _bent_a_little(random: np.random.Generator) -> Arm:
    return reach(random, out=(10, 70), up=(-80, -55), length=(0.8, 0.95), swivel=(0.0, 0.4))


def _towards_ground(arm: Arm, trunk: Trunk, side: int) -> Arm:
    """An arm of the body frame in the frame of the upper trunk; as if on the left, whatever its side."""
    x, y, z = trunk_rotation(trunk).T @ np.array(on_side(arm, side).wrist)
    return on_side(Arm((float(x), float(y), float(z)), arm.swivel), side)


def _stance(random: np.random.Generator) -> _Legs:
    """Standing, a small step, or knees a little bent."""
    if random.random() < 0.4:
        return standing(random)
    if random.random() < 0.5:
        return _crouch(random, (0.0, 0.4))
    step = float(random.uniform(0.05, 0.3))
    return Leg(-step, 0.0, float(random.uniform(0.03, 0.3))), Leg(step, 0.0, float(random.uniform(0.03, 0.15)))


def _crouch(random: np.random.Generator, knee: Range) -> _Legs:
    """Both knees bent alike, the feet under the body."""
    bent, share = uniform(random, knee, (0.42, 0.56))
    sides = [Leg(bent * share + wide, apart, bent) for wide, apart in _pairs(random, (-0.03, 0.03), (-0.08, 0.1))]
    return sides[0], sides[1]


def _pairs(random: np.random.Generator, *ranges: Range) -> list[list[float]]:
    return [uniform(random, *ranges) for _ in "lr"]


def _head(random: np.random.Generator) -> Head:
    return Head(*uniform(random, (-0.3, 0.5), (-0.7, 0.7)))


def _slight_turn(random: np.random.Generator) -> Trunk:
    return Trunk(*uniform(random, (-0.1, 0.2), (-0.12, 0.12), (-0.25, 0.25)))
