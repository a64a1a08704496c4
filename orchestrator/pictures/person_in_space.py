"""A person's estimated joints in space, with the true ones and the camera.

The *person's frame* has x to their front, y to their left and z up from the ground, metres.
"""

import math

import numpy as np
from msgspec import Struct

from protocol.arrays import BoolArray, Float64Array
from protocol.camera import CameraPose
from protocol.frame import Frame
from protocol.pose_estimate import PoseEstimate
from protocol.skeleton import Joint


class Standing(Struct, frozen=True):
    """The position and orientation of a person.

    Attributes:
        position: on the ground of the world, metres.
        yaw: radians from world x to their front, counter-clockwise seen from above.
    """

    position: tuple[float, float]
    yaw: float

    def turned(self, points: Float64Array) -> Float64Array:
        """World points (n, 3) in the person's frame."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        from_world = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return (points - (*self.position, 0.0)) @ from_world.T


class PersonInSpace(Struct, frozen=True, eq=False, kw_only=True):
    """All places are in the person's frame.

    Attributes:
        points: (18, 3) estimated joints, metres; NaN where a joint was not located.
        inferred: (18,) which were located, and not seen themselves.
        radius: (18,) metres; a sphere that holds the joint with probability 0.9; NaN where a joint was not located.
        truth: (18, 3) true joints, metres, where they are known.
        camera: (2, 3) where the camera is and the point that it looks at, metres.
        found: whether any joint was detected or located.
    """

    points: Float64Array
    inferred: BoolArray
    radius: Float64Array | None = None
    truth: Float64Array | None = None
    camera: Float64Array
    found: bool = True

    def all_points(self) -> Float64Array:
        """(n, 3) estimated and true joints, metres."""
        return self.points if self.truth is None else np.concatenate([self.points, self.truth])

    def in_words(self) -> str:
        """How many joints were located, and how far they are from the true ones at the mean."""
        if not self.found:
            return "No person was found."
        located = np.isfinite(self.points).all(axis=1)
        if not located.any():
            return "No joint was located."
        groups = [(located & ~self.inferred, "seen"), (self.inferred, "inferred")]
        return self._words_before + "; ".join(self._group_in_words(group, name) for group, name in groups) + "."

    @property
    def _words_before(self) -> str:
        return "" if self.truth is None else "Mean error: "

    def _group_in_words(self, group: BoolArray, name: str) -> str:
        count = int(group.sum())
        joints = f"{count or 'no'} {name} joint{'' if count == 1 else 's'}"
        if self.truth is None or count == 0:
            return joints
        error = float(np.linalg.norm(self.points[group] - self.truth[group], axis=1).mean())
        return f"{error:.3f} m of {joints}"


def person_in_space(frame: Frame, observation: PoseEstimate, yaw: float | None = None) -> PersonInSpace:
    """The estimate of a person, in their own frame.

    Args:
        yaw: the person's, radians from world x; where it is not told, by their shoulders, true ones if there are any.
    """
    standing = standing_of(observation.points if frame.joints is None else frame.joints, frame.camera.pose, yaw)
    return PersonInSpace(
        points=standing.turned(observation.points),
        inferred=observation.inferred,
        radius=observation.radius,
        truth=None if frame.joints is None else standing.turned(frame.joints),
        camera=standing.turned(np.array([frame.camera.pose.position, frame.camera.pose.target])),
        found=bool(np.isfinite(observation.keypoints).any() or np.isfinite(observation.points).any()),
    )


def standing_of(points: Float64Array, camera: CameraPose, yaw: float | None = None) -> Standing:
    """The standing of the person with these world joints, (18, 3).

    A person without located shoulders faces the camera; one without any located joint stands at the camera's target.
    """
    located = points[np.isfinite(points).all(axis=1)]
    x, y = np.median(located, axis=0)[:2].tolist() if len(located) else camera.target[:2]
    if yaw is None:
        yaw = facing(points)
    if yaw is None:
        yaw = math.atan2(camera.position[1] - camera.target[1], camera.position[0] - camera.target[0])
    return Standing((x, y), yaw)


def facing(points: Float64Array) -> float | None:
    """The yaw of a person with world joints (18, 3), by the shoulders; None where these are not located."""
    x, y, _ = (points[Joint.LEFT_SHOULDER] - points[Joint.RIGHT_SHOULDER]).tolist()
    return math.atan2(-x, y) if math.hypot(x, y) > 0 else None
