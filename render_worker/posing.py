"""From a `BodyPose` to the rotations of all bones."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from protocol.arrays import Float64Array
from protocol.scene import Arm, BodyPose, Head, Leg
from render_worker.arm import RestArm, pose_arm
from render_worker.rotation import cross, rotation

_NECK = ("neck01", "neck02", "neck03", "head")
"""Nodding and turning is shared evenly among these."""

_FINGER_CURL = (0.18, 0.42, 0.3)
"""Radians by which the joints of a finger are bent in a relaxed hand, from the knuckle on."""


class BonePose(NamedTuple):
    """What `skinning.bone_transforms` needs: rotations by bone, and the bones that twist about another one's head."""

    rotations: dict[int, Float64Array]
    twists: dict[int, int]


def pose_bones(pose: BodyPose, heads: Float64Array, labels: Sequence[str]) -> BonePose:
    """Turn the bones of a body.

    Args:
        heads: (b, 3) where each bone starts at rest, in the body frame, metres.
        labels: the bones' names.
    """
    index = {label: number for number, label in enumerate(labels)}
    turned: dict[str, Float64Array] = {}
    for side, arm, leg in (("L", pose.left_arm, pose.left_leg), ("R", pose.right_arm, pose.right_leg)):
        turned |= _arm_bones(side, arm, heads, index)
        turned |= _finger_bones(side, turned[f"lowerarm01.{side}"], heads, index)
        turned |= _leg_bones(side, leg)
    turned |= _head_bones(pose.head)
    twists = {f"upperarm02.{side}": f"upperarm01.{side}" for side in "LR"}
    return BonePose(
        {index[label]: turn for label, turn in turned.items()},
        {index[continuing]: index[continued] for continuing, continued in twists.items()},
    )


def _arm_bones(side: str, arm: Arm, heads: Float64Array, index: dict[str, int]) -> dict[str, Float64Array]:
    names = ("upperarm01", "lowerarm01", "wrist")
    shoulder, elbow, wrist = (heads[index[f"{name}.{side}"]] for name in names)
    posed = pose_arm(RestArm(shoulder, elbow, wrist, 1 if side == "L" else -1), arm)
    bones = {
        "clavicle": posed.girdle,
        "upperarm01": posed.upper_twist,
        "upperarm02": posed.upper,
        "lowerarm01": posed.lower,
    }
    return {f"{name}.{side}": turn for name, turn in bones.items()}


def _finger_bones(side: str, hand: Float64Array, heads: Float64Array, index: dict[str, int]) -> dict[str, Float64Array]:
    """Fingers curl towards the palm; the thumb stays."""
    knuckle, tip, thumb = (heads[index[f"{name}.{side}"]] for name in ("finger3-1", "finger3-3", "finger1-3"))
    fingers = tip - knuckle
    # Of the left hand, fingers forward and thumb up, the palm looks to the right.
    palm = cross(fingers, thumb - knuckle) * (1 if side == "L" else -1)
    across = cross(fingers, palm)
    axis = across / np.linalg.norm(across)
    bent = [hand @ rotation(angle * axis) for angle in np.cumsum(_FINGER_CURL)]
    return {
        f"finger{finger}-{joint}.{side}": turn for finger in range(2, 6) for joint, turn in enumerate(bent, start=1)
    }


def _leg_bones(side: str, leg: Leg) -> dict[str, Float64Array]:
    """Thigh and lower leg turn; the foot stays level, as one that stands."""
    outwards = 1 if side == "L" else -1
    thigh = rotation((outwards * leg.abduction, 0, 0)) @ rotation((0, -leg.flexion, 0))
    bones = {"upperleg01": thigh, "lowerleg01": thigh @ rotation((0, leg.knee, 0)), "foot": np.eye(3)}
    return {f"{name}.{side}": turn for name, turn in bones.items()}


def _head_bones(head: Head) -> dict[str, Float64Array]:
    share = np.arange(1, len(_NECK) + 1) / len(_NECK)
    return {
        bone: rotation((0, 0, part * head.turn)) @ rotation((0, part * head.pitch, 0))
        for bone, part in zip(_NECK, share, strict=True)
    }
