"""A scene as plain values: a person, what they do and wear, and what is around them.

A scene travels with every request, so any render worker can draw it. The *body frame* has its origin on the ground
between the feet, x to the person's front, y to their left, z up; a body of yaw 0 at the origin stands in the world
frame.
"""

import math
from typing import Literal, TypeAlias

from msgspec import Struct

from protocol.camera import Vector3

Split: TypeAlias = Literal["train", "test"]

TRAIN_IDENTITIES = range(40)
TEST_IDENTITIES = range(40, 60)
TRAIN_POSES = range(6)
TEST_POSES = range(8)
"""Poses 6 and 7 are never seen in training (seed, section 4.3.4)."""


class Arm(Struct, frozen=True):
    """Where a wrist is, and how the elbow hangs.

    Attributes:
        wrist: from the shoulder, in the body frame, in units of the arm's length (1 is a straight arm).
        swivel: radians by which the elbow turns out of the vertical plane through the arm, outwards positive.
    """

    wrist: Vector3
    swivel: float = 0.0


class Leg(Struct, frozen=True):
    """Radians. `flexion` lifts the thigh to the front, `abduction` to the outside, `knee` bends the lower leg back."""

    flexion: float = 0.0
    abduction: float = 0.0
    knee: float = 0.0


class Head(Struct, frozen=True):
    """Radians. `pitch` nods down, `turn` looks to the person's left."""

    pitch: float = 0.0
    turn: float = 0.0


class BodyPose(Struct, frozen=True):
    """One sample of one of the eight kinds of body pose (`kind`, 0 to 7)."""

    kind: int
    left_arm: Arm
    right_arm: Arm
    left_leg: Leg = Leg()
    right_leg: Leg = Leg()
    head: Head = Head()


class Sun(Struct, frozen=True):
    """Direction towards the sun in the world frame (radians), and how strong it is (1 is a clear day)."""

    azimuth: float
    elevation: float
    strength: float = 1.0


class Scene(Struct, frozen=True):
    """Everything that a picture depends on beside the camera.

    Attributes:
        identity: number of the body, 0 to 59.
        appearance: seed of skin, hair and garments.
        position: of the body on the ground, world x and y in metres.
        yaw: radians from world x to the person's front, counter-clockwise seen from above.
        ground, background: names of images that the render worker knows.
    """

    identity: int
    pose: BodyPose
    appearance: int
    position: tuple[float, float]
    yaw: float
    sun: Sun
    ground: str
    background: str

    def __post_init__(self) -> None:
        if not (0 <= self.identity < 60 and 0 <= self.pose.kind < 8):
            raise ValueError("identities are numbered 0 to 59, poses 0 to 7")
        if not all(math.isfinite(value) for value in (*self.position, self.yaw)):
            raise ValueError("a person's position and yaw must be finite")

    @property
    def facing(self) -> tuple[float, float]:
        """Unit vector on the ground, in the world frame, that the person looks along."""
        return math.cos(self.yaw), math.sin(self.yaw)
