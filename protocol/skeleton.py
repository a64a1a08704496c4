"""The skeleton of all rooms: COCO-18 in OpenPose's order."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from protocol.arrays import Float64Array


class Joint(IntEnum):
    """A joint of the COCO-18 skeleton; left and right are the person's own."""

    NOSE = 0
    NECK = 1
    RIGHT_SHOULDER = 2
    RIGHT_ELBOW = 3
    RIGHT_WRIST = 4
    LEFT_SHOULDER = 5
    LEFT_ELBOW = 6
    LEFT_WRIST = 7
    RIGHT_HIP = 8
    RIGHT_KNEE = 9
    RIGHT_ANKLE = 10
    LEFT_HIP = 11
    LEFT_KNEE = 12
    LEFT_ANKLE = 13
    RIGHT_EYE = 14
    LEFT_EYE = 15
    RIGHT_EAR = 16
    LEFT_EAR = 17


JOINT_COUNT = len(Joint)

COCO_17: tuple[Joint, ...] = (
    Joint.NOSE,
    Joint.LEFT_EYE,
    Joint.RIGHT_EYE,
    Joint.LEFT_EAR,
    Joint.RIGHT_EAR,
    Joint.LEFT_SHOULDER,
    Joint.RIGHT_SHOULDER,
    Joint.LEFT_ELBOW,
    Joint.RIGHT_ELBOW,
    Joint.LEFT_WRIST,
    Joint.RIGHT_WRIST,
    Joint.LEFT_HIP,
    Joint.RIGHT_HIP,
    Joint.LEFT_KNEE,
    Joint.RIGHT_KNEE,
    Joint.LEFT_ANKLE,
    Joint.RIGHT_ANKLE,
)
"""COCO's own 17 joints in COCO's order, which has no neck."""

LIMBS: tuple[tuple[Joint, Joint], ...] = (
    (Joint.NECK, Joint.RIGHT_SHOULDER),
    (Joint.NECK, Joint.LEFT_SHOULDER),
    (Joint.RIGHT_SHOULDER, Joint.RIGHT_ELBOW),
    (Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST),
    (Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW),
    (Joint.LEFT_ELBOW, Joint.LEFT_WRIST),
    (Joint.NECK, Joint.RIGHT_HIP),
    (Joint.RIGHT_HIP, Joint.RIGHT_KNEE),
    (Joint.RIGHT_KNEE, Joint.RIGHT_ANKLE),
    (Joint.NECK, Joint.LEFT_HIP),
    (Joint.LEFT_HIP, Joint.LEFT_KNEE),
    (Joint.LEFT_KNEE, Joint.LEFT_ANKLE),
    (Joint.NECK, Joint.NOSE),
    (Joint.NOSE, Joint.RIGHT_EYE),
    (Joint.RIGHT_EYE, Joint.RIGHT_EAR),
    (Joint.NOSE, Joint.LEFT_EYE),
    (Joint.LEFT_EYE, Joint.LEFT_EAR),
)
"""The bones of the skeleton, as drawn."""


def _mirrored_joints() -> list[int]:
    opposite = {"LEFT": "RIGHT", "RIGHT": "LEFT"}
    names = [joint.name.split("_", 1) for joint in Joint]
    return [Joint["_".join([opposite.get(name[0], name[0]), *name[1:]])] for name in names]


MIRRORED: NDArray[np.intp] = np.array(_mirrored_joints(), dtype=np.intp)
"""(18,) for each joint, the one on the body's other side; itself for joints in the middle."""

_UPPER_BODY_WEIGHTS: dict[Joint, float] = {
    Joint.NOSE: 2.0,
    Joint.LEFT_EYE: 2.0,
    Joint.RIGHT_EYE: 2.0,
    Joint.LEFT_SHOULDER: 0.5,
    Joint.RIGHT_SHOULDER: 0.5,
    Joint.LEFT_ELBOW: 0.5,
    Joint.RIGHT_ELBOW: 0.5,
    Joint.LEFT_WRIST: 0.5,
    Joint.RIGHT_WRIST: 0.5,
    Joint.NECK: 1.0,
}


def upper_body_weights() -> Float64Array:
    """(18,) weights of the joints that a handover needs; they sum to 10. Source: thesis, section 4.3.5."""
    return np.array([_UPPER_BODY_WEIGHTS.get(joint, 0.0) for joint in Joint])


def weighted_uncertainty(quality: Float64Array) -> float:
    """The weighted uncertainty of the upper body, from 0 (certain) to 10.

    Args:
        quality: (18,) combined quality of each joint, in [0, 1].

    Source: thesis, section 4.3.5.
    """
    return float(upper_body_weights() @ (1.0 - quality))
