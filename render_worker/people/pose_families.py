"""Families of poses to test on, all of kind 0: none of them is drawn by `wide_poses`, nor by the eight kinds."""

import math
from collections.abc import Callable, Mapping
from typing import Literal, TypeAlias

import numpy as np

from protocol.scene import Arm, BodyPose, Head, Leg, Trunk
from render_worker.people.clearance import is_clear
from render_worker.people.limbs import mirrored, on_side, reach, standing, uniform

Family: TypeAlias = Literal["overhead", "crossed", "squat", "kneel", "sit"]

LEAST_OVERHEAD = math.radians(50)
"""Elevation of a raised arm's wrist above its shoulder, in the frame of the trunk."""

LEAST_CROSSED = 0.4
"""How far both wrists are from their shoulders towards the other side, in units of the arm's length."""

LEAST_KNEE = 1.3
"""Radians that each knee is bent by who squats, kneels or sits."""

_KNEELING_SHIN = 1.86
"""Radians from the vertical of a lower leg whose knee and toes are on the ground: the heel is a little higher."""

_FRONT_THIGH = 1.59
"""Flexion of the other leg of who kneels on one knee. Its foot is on the ground within 2 cm for half of the identities,
within 6 cm for all: thighs and lower legs differ."""

_Legs = tuple[Leg, Leg]


def sample_family(family: Family, random: np.random.Generator) -> BodyPose:
    """Draw one pose of a family; as often left-handed as right-handed. No arm of it is in the trunk."""
    while True:
        pose = _FAMILIES[family](random)
        pose = mirrored(pose) if random.random() < 0.5 else pose
        if is_clear(pose.left_arm, 1) and is_clear(pose.right_arm, -1):
            return pose


def _overhead(random: np.random.Generator) -> BodyPose:
    other = _raised(random) if random.random() < 0.5 else _idle_arm(random)
    return _pose(random, (_raised(random), other), standing(random), _little_turn(random))


def _raised(random: np.random.Generator) -> Arm:
    return reach(random, out=(0, 100), up=(math.degrees(LEAST_OVERHEAD), 85), length=(0.75, 0.98), swivel=(0.2, 0.8))


def _crossed(random: np.random.Generator) -> BodyPose:
    """One forearm lies over the other."""
    below, over = (_before_chest(random, ahead) for ahead in ((0.4, 0.45), (0.53, 0.58)))
    return _pose(random, (over, below), standing(random), _little_turn(random))


def _before_chest(random: np.random.Generator, ahead: tuple[float, float]) -> Arm:
    x, across, z, swivel = uniform(random, ahead, (LEAST_CROSSED, 0.5), (-0.4, -0.28), (0.9, 1.2))
    return Arm((x, -across, z), swivel)


def _squat(random: np.random.Generator) -> BodyPose:
    flexion, shin, bend = uniform(random, (1.3, 1.9), (0.4, 0.6), (0.2, 0.55))
    legs = _alike(random, flexion, shin)
    return _pose(random, (_idle_arm(random), _idle_arm(random)), legs, _little_turn(random, bend))


def _kneel(random: np.random.Generator) -> BodyPose:
    """On both knees, or on the right one alone."""
    flexion, shin = uniform(random, (-0.1, 0.35), (_KNEELING_SHIN - 0.02, _KNEELING_SHIN + 0.02))
    legs = _alike(random, flexion, shin) if random.random() < 0.5 else _on_one_knee(random)
    return _pose(random, (_idle_arm(random), _idle_arm(random)), legs, _little_turn(random))


def _on_one_knee(random: np.random.Generator) -> _Legs:
    shin, front_shin = uniform(random, (-0.02, 0.02), (-0.1, 0.15))
    return Leg(_FRONT_THIGH, 0.0, _FRONT_THIGH + front_shin), Leg(0.0, 0.0, _KNEELING_SHIN + shin)


def _sit(random: np.random.Generator) -> BodyPose:
    flexion, shin, bend = uniform(random, (1.35, 1.6), (-0.05, 0.3), (-0.05, 0.4))
    legs = _alike(random, flexion, shin)
    return _pose(random, (_idle_arm(random), _idle_arm(random)), legs, _little_turn(random, bend))


def _alike(random: np.random.Generator, flexion: float, shin: float) -> _Legs:
    """Two legs whose feet come to the same height."""
    apart = uniform(random, (-0.05, 0.12), (-0.05, 0.12))
    left, right = (Leg(flexion, abduction, flexion + shin) for abduction in apart)
    return left, right


def _idle_arm(random: np.random.Generator) -> Arm:
    """A hand that is held out above the knees, or hangs beside them."""
    if random.random() < 0.5:
        return reach(random, out=(45, 75), up=(-80, -65), length=(0.9, 0.98), swivel=(0.0, 0.2))
    return reach(random, out=(-10, 60), up=(-40, 10), length=(0.6, 0.95), swivel=(0.1, 0.4))


def _little_turn(random: np.random.Generator, bend: float = 0.0) -> Trunk:
    more, lean, twist = uniform(random, (-0.08, 0.12), (-0.1, 0.1), (-0.25, 0.25))
    return Trunk(bend + more, lean, twist)


def _pose(random: np.random.Generator, arms: tuple[Arm, Arm], legs: _Legs, trunk: Trunk) -> BodyPose:
    """Of two arms as if both were on the left."""
    head = Head(*uniform(random, (-0.2, 0.3), (-0.5, 0.5)))
    return BodyPose(0, on_side(arms[0], 1), on_side(arms[1], -1), *legs, head=head, trunk=trunk)


_FAMILIES: Mapping[Family, Callable[[np.random.Generator], BodyPose]] = {
    "overhead": _overhead,
    "crossed": _crossed,
    "squat": _squat,
    "kneel": _kneel,
    "sit": _sit,
}
