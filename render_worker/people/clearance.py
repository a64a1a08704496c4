"""Whether an arm keeps out of the trunk and the head, told for a body of usual proportions."""

import numpy as np

from protocol.scene import Arm
from render_worker.people.arm import elbow_of

_MIDLINE = 0.337
"""How far the middle of the trunk is from a shoulder, in units of the arm's length, as all below."""

_HALF_BREADTH, _HALF_DEPTH, _FORWARD = 0.33, 0.30, 0.03
"""Of an upright column of elliptical section that holds the trunk and the head, with half an arm's thickness."""

_HAND = 0.3
"""From the wrist to the knuckles of the fingers."""

_CHECKED = np.linspace(0.0, 1.0, 9)[:, None]


def is_clear(arm: Arm, side: int) -> bool:
    """Whether elbow, forearm and hand are outside trunk and head; `side` is 1 for the left arm, -1 for the right."""
    elbow, wrist = elbow_of(arm, side), np.array(arm.wrist)
    forearm = wrist - elbow
    tip = wrist + _HAND * forearm / np.linalg.norm(forearm)
    points = elbow + _CHECKED * (tip - elbow)
    across = (side * points[:, 1] + _MIDLINE) / _HALF_BREADTH
    ahead = (points[:, 0] - _FORWARD) / _HALF_DEPTH
    return bool((across**2 + ahead**2 > 1).all())
