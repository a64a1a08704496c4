"""Limbs to draw poses from: an arm towards a direction, legs that stand; and how far a limb of a pose goes."""

import math

import numpy as np
from msgspec.structs import replace

from protocol.camera import Vector3
from protocol.scene import Arm, BodyPose, Head, Leg, Trunk

Range = tuple[float, float]


def uniform(random: np.random.Generator, *ranges: Range) -> list[float]:
    """A number out of each range."""
    return [float(random.uniform(*one)) for one in ranges]


def reach(random: np.random.Generator, *, out: Range, up: Range, length: Range, swivel: Range = (0.1, 0.3)) -> Arm:
    """A left arm towards a direction: `out` of the sagittal plane and `up` from level, in degrees."""
    azimuth, elevation = np.radians(random.uniform(*out)), np.radians(random.uniform(*up))
    distance = random.uniform(*length)
    level = distance * np.cos(elevation)
    wrist: Vector3 = (
        float(level * np.cos(azimuth)),
        float(level * np.sin(azimuth)),
        float(distance * np.sin(elevation)),
    )
    return Arm(wrist, float(random.uniform(*swivel)))


def hanging(random: np.random.Generator) -> Arm:
    """A left arm that hangs down."""
    return reach(random, out=(20, 50), up=(-80, -72), length=(0.93, 0.98), swivel=(-0.1, 0.15))


def standing(random: np.random.Generator) -> tuple[Leg, Leg]:
    """Standing legs."""
    legs = [Leg(flexion=float(random.uniform(-0.03, 0.03)), abduction=float(random.uniform(-0.08, 0.02))) for _ in "lr"]
    return legs[0], legs[1]


def on_side(arm: Arm, side: int) -> Arm:
    """A left arm, or its mirror image where `side` is -1."""
    x, y, z = arm.wrist
    return Arm((x, side * y, z), arm.swivel)


def mirrored(pose: BodyPose) -> BodyPose:
    """The same pose with left and right exchanged."""
    return replace(
        pose,
        left_arm=on_side(pose.right_arm, -1),
        right_arm=on_side(pose.left_arm, -1),
        left_leg=pose.right_leg,
        right_leg=pose.left_leg,
        head=Head(pose.head.pitch, -pose.head.turn),
        trunk=Trunk(pose.trunk.bend, -pose.trunk.lean, -pose.trunk.twist),
    )


def elevation(arm: Arm) -> float:
    """Radians by which the wrist is above the shoulder's level, seen from the shoulder, in the frame of the trunk."""
    x, y, z = arm.wrist
    return math.atan2(z, math.hypot(x, y))


def inward(arm: Arm, side: int) -> float:
    """How far a wrist is from its shoulder towards the other one, in units of the arm's length; `side` as ever."""
    return -side * arm.wrist[1]


def shin_pitch(leg: Leg) -> float:
    """Radians by which the lower leg is turned from the vertical, its foot to the back."""
    return leg.knee - leg.flexion
