"""A scene as plain values: people, what they do and wear, and what is around them.

A scene travels with every request, so any render worker can draw it. The *body frame* has its origin on the ground
between the feet, x to the person's front, y to their left, z up; a body of yaw 0 at the origin stands in the world
frame.
"""

import math
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, Struct, field
from msgspec.structs import force_setattr

from protocol.quantities import ArmLengths, Coordinate, Elevation, Heading, JointAngle, Seed, SunStrength

Split: TypeAlias = Literal["train", "test"]

Poses: TypeAlias = Literal["kinds", "wide", "overhead", "crossed", "squat", "kneel", "sit"]
"""What a scene's pose is drawn from: the eight kinds; `wide`, to train on; or a family that `wide` keeps out of.

A scene's randomness counts from the name's place here, so a new one is the last.
"""

TRAIN_IDENTITIES = range(40)
TEST_IDENTITIES = range(40, 60)
TRAIN_POSES = range(6)
TEST_POSES = range(8)
"""Poses 6 and 7 are never seen in training (thesis, section 4.3.4)."""

Identity: TypeAlias = Annotated[int, Meta(ge=0, lt=60)]
PoseKind: TypeAlias = Annotated[int, Meta(ge=0, lt=8)]

MOST_BYSTANDERS = 8
"""So that a request can't ask for a crowd that no renderer has the memory for."""


class Arm(Struct, frozen=True):
    """Where a wrist is, and how the elbow hangs.

    Attributes:
        wrist: from the shoulder, in units of the arm's length (1 is a straight arm), in the frame of the upper trunk:
            the body frame, turned as the trunk is.
        swivel: radians by which the elbow turns out of the vertical plane through the arm, outwards positive.
    """

    wrist: tuple[ArmLengths, ArmLengths, ArmLengths]
    swivel: JointAngle = 0.0


class Leg(Struct, frozen=True):
    """Radians. `flexion` lifts the thigh to the front, `abduction` to the outside, `knee` bends the lower leg back.

    The foot is level as far as the ankle can bend.
    """

    flexion: JointAngle = 0.0
    abduction: JointAngle = 0.0
    knee: JointAngle = 0.0


class Head(Struct, frozen=True):
    """Radians, against the upper trunk. `pitch` nods down, `turn` looks to the person's left."""

    pitch: JointAngle = 0.0
    turn: JointAngle = 0.0


class Trunk(Struct, frozen=True):
    """Radians by which the shoulders are turned against the pelvis, which stays as it is.

    The spine twists about itself by `twist`, to the person's left, and then tilts to the front by `bend` and to the
    left by `lean`, about one axis.
    """

    bend: JointAngle = 0.0
    lean: JointAngle = 0.0
    twist: JointAngle = 0.0


UPRIGHT = Trunk()


# An upright pose is encoded as it was before there was a trunk: the noise of depth is seeded by the bytes. Legs and
# head have factories, since a default that one makes is never omitted.
class BodyPose(Struct, frozen=True, omit_defaults=True):
    """What a body does: a sample of one of the eight kinds of body pose (`kind`, 0 to 7), or a pose of no kind (0)."""

    kind: PoseKind
    left_arm: Arm
    right_arm: Arm
    left_leg: Leg = field(default_factory=Leg)
    right_leg: Leg = field(default_factory=Leg)
    head: Head = field(default_factory=Head)
    trunk: Trunk = UPRIGHT

    def __post_init__(self) -> None:
        # Only the default itself is omitted, not what equals it; equal poses must be equal bytes.
        if self.trunk == UPRIGHT:
            force_setattr(self, "trunk", UPRIGHT)


class Sun(Struct, frozen=True):
    """Direction towards the sun in the world frame (radians), and how strong it is (1 is a clear day)."""

    azimuth: Heading
    elevation: Elevation
    strength: SunStrength = 1.0


class Figure(Struct, frozen=True):
    """Somebody in a scene.

    Attributes:
        identity: number of the body, 0 to 59.
        appearance: seed of skin, hair and garments.
        position: of the body on the ground, world x and y in metres.
        yaw: radians from world x to the person's front, counter-clockwise seen from above.
    """

    identity: Identity
    pose: BodyPose
    appearance: Seed
    position: tuple[Coordinate, Coordinate]
    yaw: Heading

    def __post_init__(self) -> None:
        _require_possible(self)


# Without bystanders a scene is encoded as it was before there were any: the noise of depth is seeded by the bytes.
class Scene(Struct, frozen=True, omit_defaults=True):
    """Everything that a picture depends on beside the camera.

    Attributes:
        identity, pose, appearance, position, yaw: of the person who is looked at, as a `Figure`'s.
        ground, background: names of images that the render worker knows.
        bystanders: who else is there; a frame's truth is not theirs.
    """

    identity: Identity
    pose: BodyPose
    appearance: Seed
    position: tuple[Coordinate, Coordinate]
    yaw: Heading
    sun: Sun
    ground: str
    background: str
    bystanders: tuple[Figure, ...] = ()

    def __post_init__(self) -> None:
        if len(self.bystanders) > MOST_BYSTANDERS:
            raise ValueError(f"{len(self.bystanders)} bystanders are a crowd; at most {MOST_BYSTANDERS} are drawn")
        _require_possible(self)

    @property
    def person(self) -> Figure:
        """Who is looked at."""
        return Figure(self.identity, self.pose, self.appearance, self.position, self.yaw)

    @property
    def facing(self) -> tuple[float, float]:
        """Unit vector on the ground, in the world frame, that the person looks along."""
        return math.cos(self.yaw), math.sin(self.yaw)


def _require_possible(somebody: Figure | Scene) -> None:
    if not (0 <= somebody.identity < 60 and 0 <= somebody.pose.kind < 8):
        raise ValueError("identities are numbered 0 to 59, poses 0 to 7")
    if not all(math.isfinite(value) for value in (*somebody.position, somebody.yaw)):
        raise ValueError("a person's position and yaw must be finite")
