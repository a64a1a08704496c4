"""From a `BodyPose` to the rotations of all bones."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from protocol.arrays import Float64Array
from protocol.scene import Arm, BodyPose, Head, Leg, Trunk
from render_worker.people.arm import RestArm, pose_arm
from render_worker.rotation import cross, rotation

_NECK = ("neck01", "neck02", "neck03", "head")
"""Nodding and turning is shared evenly among these."""

_SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01")
"""From the pelvis up. Bending, leaning and twisting is shared evenly among these."""

_TOES = tuple(f"toe{toe}-1" for toe in range(1, 6))

_MOST_DORSIFLEXION, _MOST_PLANTARFLEXION = 0.6, 0.85
"""Radians that an ankle lifts the foot towards the shin, and stretches it."""

_MOST_TOE_LIFT = 1.1
"""Radians that toes bend up against the foot, as when a heel is off the ground."""

_FINGER_CURL = (0.18, 0.42, 0.3)
"""Radians by which the joints of a finger are bent in a relaxed hand, from the knuckle on."""


class BonePose(NamedTuple):
    """The input of `skinning.bone_transforms`: rotations by bone, and the bones that twist about another's head."""

    rotations: dict[int, Float64Array]
    twists: dict[int, int]


def pose_bones(pose: BodyPose, heads: Float64Array, labels: Sequence[str]) -> BonePose:
    """Turn the bones of a body.

    Args:
        heads: (b, 3) where each bone starts at rest, in the body frame, metres.
        labels: the bones' names.
    """
    index = {label: number for number, label in enumerate(labels)}
    turned = _spine_bones(pose.trunk)
    trunk = turned[_SPINE[-1]]
    for side, arm, leg in (("L", pose.left_arm, pose.left_leg), ("R", pose.right_arm, pose.right_leg)):
        turned |= _arm_bones(side, arm, trunk, heads, index)
        turned |= _finger_bones(side, turned[f"lowerarm01.{side}"], heads, index)
        turned |= _leg_bones(side, leg)
    turned |= _head_bones(pose.head, trunk)
    twists = {f"upperarm02.{side}": f"upperarm01.{side}" for side in "LR"}
    return BonePose(
        {index[label]: turn for label, turn in turned.items()},
        {index[continuing]: index[continued] for continuing, continued in twists.items()},
    )


def trunk_rotation(trunk: Trunk, share: float = 1.0) -> Float64Array:
    """The turn (3, 3) of the upper trunk from the body frame, or of a `share` of the way up to it."""
    tilt = rotation((-share * trunk.lean, share * trunk.bend, 0))
    return tilt @ rotation((0, 0, share * trunk.twist))


def _spine_bones(trunk: Trunk) -> dict[str, Float64Array]:
    count = len(_SPINE)
    return {bone: trunk_rotation(trunk, number / count) for number, bone in enumerate(_SPINE, start=1)}


def _arm_bones(
    side: str, arm: Arm, trunk: Float64Array, heads: Float64Array, index: dict[str, int]
) -> dict[str, Float64Array]:
    names = ("upperarm01", "lowerarm01", "wrist")
    shoulder, elbow, wrist = (heads[index[f"{name}.{side}"]] for name in names)
    posed = pose_arm(RestArm(shoulder, elbow, wrist, 1 if side == "L" else -1), arm)
    bones = {
        "clavicle": posed.girdle,
        "upperarm01": posed.upper_twist,
        "upperarm02": posed.upper,
        "lowerarm01": posed.lower,
    }
    return {f"{name}.{side}": trunk @ turn for name, turn in bones.items()}


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
    """Thigh and lower leg turn; foot and toes are level, as of one who stands, as far as ankle and toes can bend."""
    outwards = 1 if side == "L" else -1
    thigh = rotation((outwards * leg.abduction, 0, 0)) @ rotation((0, -leg.flexion, 0))
    bones = {"upperleg01": thigh, "lowerleg01": thigh @ rotation((0, leg.knee, 0))}
    shin = leg.knee - leg.flexion
    foot = _nearest_to_level(shin - _MOST_DORSIFLEXION, shin + _MOST_PLANTARFLEXION)
    bones["foot"] = rotation((0, foot, 0))
    bones |= dict.fromkeys(_TOES, rotation((0, _nearest_to_level(foot - _MOST_TOE_LIFT, foot), 0)))
    return {f"{name}.{side}": turn for name, turn in bones.items()}


def _nearest_to_level(lowest: float, highest: float) -> float:
    """The pitch nearest to 0 within a range, radians, toes down positive."""
    return min(max(0.0, lowest), highest)


def _head_bones(head: Head, trunk: Float64Array) -> dict[str, Float64Array]:
    share = np.arange(1, len(_NECK) + 1) / len(_NECK)
    return {
        bone: trunk @ rotation((0, 0, part * head.turn)) @ rotation((0, part * head.pitch, 0))
        for bone, part in zip(_NECK, share, strict=True)
    }
