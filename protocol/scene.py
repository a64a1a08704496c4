"""A scene as plain values: people, their poses and clothes, and their surroundings.

Every request carries its scene, so any render worker can draw it. The *body frame* has its origin on the ground
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
"""What a scene's pose is drawn from: the eight kinds; `wide`, to train on; or a family that `wide` excludes.

The name's index here is part of the scene's random seed, so add new names at the end.
"""

TRAIN_IDENTITIES = range(40)
TEST_IDENTITIES = range(40, 60)
TRAIN_POSES = range(6)
TEST_POSES = range(8)
"""Poses 6 and 7 are never seen in training (thesis, section 4.3.4)."""

Identity: TypeAlias = Annotated[int, Meta(ge=0, lt=60)]
PoseKind: TypeAlias = Annotated[int, Meta(ge=0, lt=8)]

MOST_BYSTANDERS = 8
"""Limits the memory of a renderer that one request needs."""


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


# An upright pose has the same encoding as before the trunk was added, since the bytes seed the noise of depth. Legs and
# head have factories, since msgspec never omits a default that a factory makes.
class BodyPose(Struct, frozen=True, omit_defaults=True):
    """A body's pose: a sample of one of the eight kinds of pose (`kind`, 0 to 7), or a pose of no kind (0)."""

    kind: PoseKind
    left_arm: Arm
    right_arm: Arm
    left_leg: Leg = field(default_factory=Leg)
    right_leg: Leg = field(default_factory=Leg)
    head: Head = field(default_factory=Head)
    trunk: Trunk = UPRIGHT

    def __post_init__(self) -> None:
        # msgspec omits only the default object itself, and equal poses must have equal bytes.
        if self.trunk == UPRIGHT:
            force_setattr(self, "trunk", UPRIGHT)


class Sun(Struct, frozen=True):
    """Direction towards the sun in the world frame (radians), and how strong it is (1 is a clear day)."""

    azimuth: Heading
    elevation: Elevation
    strength: SunStrength = 1.0


class Figure(Struct, frozen=True):
    """A person in a scene.

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


# Without bystanders a scene has the same encoding as before they were added, since the bytes seed the noise of depth.
class Scene(Struct, frozen=True, omit_defaults=True):
    """Everything that a picture depends on, apart from the camera.

    Attributes:
        identity, pose, appearance, position, yaw: of the person whose pose is estimated, as in `Figure`.
        ground, background: names of images that the render worker knows.
        bystanders: other people; a frame's truth does not include them.
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
        """The person whose pose is estimated."""
        return Figure(self.identity, self.pose, self.appearance, self.position, self.yaw)

    @property
    def facing(self) -> tuple[float, float]:
        """The direction that the person faces: a unit vector on the ground, in the world frame."""
        return math.cos(self.yaw), math.sin(self.yaw)


def _require_possible(person: Figure | Scene) -> None:
    if not (0 <= person.identity < 60 and 0 <= person.pose.kind < 8):
        raise ValueError("identities are numbered 0 to 59, poses 0 to 7")
    if not all(math.isfinite(value) for value in (*person.position, person.yaw)):
        raise ValueError("a person's position and yaw must be finite")
