"""Poses to train on: joint angles over the joints' ranges, all of kind 0.

They keep out of every family of `pose_families`, which are there to be tested on: no arm is up, one wrist at most is on
the body's other side, one knee at most is bent as far as both are of who squats, kneels or sits.
"""

import math
from collections.abc import Callable

import numpy as np

from protocol.scene import Arm, BodyPose, Head, Leg, Trunk
from render_worker.people.clearance import is_clear
from render_worker.people.limbs import Range, elevation, hanging, inward, mirrored, on_side, reach, standing, uniform
from render_worker.people.posing import trunk_rotation

MOST_ELEVATION = math.radians(40)
"""Of a wrist above its shoulder, in the frame of the trunk."""

MOST_INWARD, MOST_ACROSS = 0.25, 0.6
"""Of the wrists from their shoulders, in units of the arm's length: of that which stays on its own side of the body,
and of the other."""

MOST_KNEE, MOST_ONE_KNEE = 1.1, 2.1
"""Radians that the knee is bent which is bent less, as in a crouch, and the other."""

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
    less_across, more_across = sorted(inward(arm, side) for arm, side in sides)
    straighter, more_bent = sorted((pose.left_leg.knee, pose.right_leg.knee))
    return (
        all(elevation(arm) <= MOST_ELEVATION for arm, _ in sides)
        and less_across <= MOST_INWARD
        and more_across <= MOST_ACROSS
        and straighter <= MOST_KNEE
        and more_bent <= MOST_ONE_KNEE
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


def _reaching_across(random: np.random.Generator) -> BodyPose:
    """A hand at the other side's hip, ribs, shoulder or cheek."""
    return _pose((_across(random), _some_arm(random)), _stance(random), _head(random), _slight_turn(random))


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
    legs = _crouch(random, (0.3, MOST_KNEE)) if random.random() < 0.7 else _lunge(random)
    return _pose((_held_out(random), _some_arm(random)), legs, _head(random), trunk)


def _lifting_a_leg(random: np.random.Generator) -> BodyPose:
    """On one leg, or with a foot on a step."""
    trunk = Trunk(*uniform(random, (-0.15, 0.6), (-0.2, 0.2), (-0.3, 0.3)))
    legs = _lifted_leg(random), _bearing_leg(random)
    return _pose((_some_arm(random), _some_arm(random)), legs, _head(random), trunk)


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
    (_arms_anywhere, 0.14),
    (_holding_out, 0.12),
    (_reaching_across, 0.12),
    (_bending, 0.1),
    (_leaning, 0.05),
    (_crouching, 0.18),
    (_lifting_a_leg, 0.2),
    (_walking, 0.04),
    (_looking_about, 0.05),
)
_PARTS = tuple(part for part, _ in _MIXTURE)
_SHARES = tuple(share for _, share in _MIXTURE)


def _pose(arms: tuple[Arm, Arm], legs: _Legs, head: Head, trunk: Trunk) -> BodyPose:
    """Of two arms as if both were on the left."""
    return BodyPose(0, on_side(arms[0], 1), on_side(arms[1], -1), *legs, head=head, trunk=trunk)


def _any_arm(random: np.random.Generator) -> Arm:
    if random.random() < 0.15:
        return reach(random, out=(110, 155), up=(-80, -40), length=(0.8, 0.98), swivel=(-0.2, 0.3))
    up = (10, math.degrees(MOST_ELEVATION)) if random.random() < 0.3 else (-80, 25)
    return reach(random, out=(-40, 110), up=up, length=(0.5, 0.98), swivel=(-0.2, 0.8))


def _some_arm(random: np.random.Generator) -> Arm:
    """One that hangs, is held out or is anywhere."""
    drawn = random.random()
    if drawn < 0.4:
        return _resting(random)
    return _held_out(random) if drawn < 0.7 else _any_arm(random)


def _across(random: np.random.Generator) -> Arm:
    ahead, across, up, swivel = uniform(random, (0.3, 0.7), (0.05, MOST_ACROSS), (-0.5, 0.25), (0.2, 1.2))
    return Arm((ahead, -across, up), swivel)


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


def _lunge(random: np.random.Generator) -> _Legs:
    """One foot behind the other, both on the ground where thighs are as long as lower legs."""
    thigh, shin, behind = uniform(random, (0.5, 1.1), (-0.1, 0.4), (0.0, 0.5))
    height = math.cos(thigh) + math.cos(shin)
    shin_behind = math.acos(min(max(height - math.cos(behind), -1.0), 1.0))
    return Leg(-behind, 0.0, max(shin_behind - behind, 0.0)), Leg(thigh, 0.0, thigh + shin)


def _lifted_leg(random: np.random.Generator) -> Leg:
    """The thigh up to level with the lower leg below it, or the foot behind."""
    if random.random() < 0.6:
        thigh, abduction, shin = uniform(random, (0.2, 1.65), (-0.05, 0.45), (-0.3, 0.5))
    else:
        thigh, abduction, shin = uniform(random, (-0.3, 0.6), (-0.05, 0.2), (0.6, 1.9))
    return Leg(thigh, abduction, min(max(thigh + shin, 0.0), MOST_ONE_KNEE))


def _bearing_leg(random: np.random.Generator) -> Leg:
    thigh, abduction, shin = uniform(random, (-0.1, 0.3), (-0.08, 0.1), (-0.05, 0.25))
    return Leg(thigh, abduction, max(thigh + shin, 0.0))


def _pairs(random: np.random.Generator, *ranges: Range) -> list[list[float]]:
    return [uniform(random, *ranges) for _ in "lr"]


def _head(random: np.random.Generator) -> Head:
    return Head(*uniform(random, (-0.3, 0.5), (-0.7, 0.7)))


def _slight_turn(random: np.random.Generator) -> Trunk:
    return Trunk(*uniform(random, (-0.1, 0.2), (-0.12, 0.12), (-0.25, 0.25)))
