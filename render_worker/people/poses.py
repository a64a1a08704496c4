"""The eight kinds of body pose as ranges to draw from (0 to 5 for training, 6 and 7 never seen there).

Three are handovers, in which a hand is held out: 1 (to the front), 3 (low and bent) and 6 (to the front and the side).
Every kind that is not symmetric comes left- and right-handed.
"""

from collections.abc import Callable

import numpy as np

from protocol.scene import Arm, BodyPose, Head, Leg
from render_worker.people.limbs import hanging, on_side, reach, standing

HANDOVER_POSES = (1, 3, 6)


def sample_pose(kind: int, random: np.random.Generator) -> BodyPose:
    """Draw one pose of a kind, 0 to 7."""
    active, other, legs = _KINDS[kind](random)
    left_handed = bool(random.random() < 0.5)
    left_leg, right_leg = (legs[0], legs[1]) if left_handed else (legs[1], legs[0])
    head = Head(pitch=float(random.uniform(-0.05, 0.2)), turn=float(random.uniform(-0.25, 0.25)))
    left_arm, right_arm = (active, other) if left_handed else (other, active)
    return BodyPose(kind, on_side(left_arm, 1), on_side(right_arm, -1), left_leg, right_leg, head)


_Limbs = tuple[Arm, Arm, tuple[Leg, Leg]]
"""The active arm, the other one (both as if on the left), and the legs of their sides."""


def _idle(random: np.random.Generator) -> _Limbs:
    return hanging(random), hanging(random), standing(random)


def _handover(random: np.random.Generator) -> _Limbs:
    active = reach(random, out=(-8, 15), up=(-28, 0), length=(0.72, 0.93))
    return active, hanging(random), standing(random)


def _arms_open(random: np.random.Generator) -> _Limbs:
    def arm() -> Arm:
        return reach(random, out=(65, 85), up=(-58, -35), length=(0.9, 0.98), swivel=(-0.1, 0.2))

    return arm(), arm(), standing(random)


def _low_handover(random: np.random.Generator) -> _Limbs:
    active = reach(random, out=(-5, 25), up=(-52, -35), length=(0.66, 0.85))
    return active, hanging(random), standing(random)


def _side_raise(random: np.random.Generator) -> _Limbs:
    active = reach(random, out=(70, 92), up=(-30, 15), length=(0.88, 0.98), swivel=(-0.1, 0.2))
    return active, hanging(random), standing(random)


def _stride(random: np.random.Generator) -> _Limbs:
    step = float(random.uniform(0.16, 0.3))
    front = reach(random, out=(5, 20), up=(-72, -60), length=(0.86, 0.94))
    back = reach(random, out=(130, 160), up=(-76, -66), length=(0.94, 0.98))
    return front, back, (Leg(flexion=-step, knee=0.06), Leg(flexion=step, knee=0.06))


def _stepping_handover(random: np.random.Generator) -> _Limbs:
    step = float(random.uniform(0.12, 0.24))
    active = reach(random, out=(15, 45), up=(-22, 8), length=(0.75, 0.95))
    return active, hanging(random), (Leg(flexion=-step, knee=0.05), Leg(flexion=step, knee=0.05))


def _both_forward(random: np.random.Generator) -> _Limbs:
    def arm() -> Arm:
        return reach(random, out=(-6, 14), up=(-38, -12), length=(0.62, 0.86), swivel=(0.1, 0.4))

    return arm(), arm(), standing(random)


_KINDS: tuple[Callable[[np.random.Generator], _Limbs], ...] = (
    _idle,
    _handover,
    _arms_open,
    _low_handover,
    _side_raise,
    _stride,
    _stepping_handover,
    _both_forward,
)
