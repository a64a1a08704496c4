"""The 111 numbers of an observation as the networks take them: seen from the person, turned to the drone.

A flight turned about the person is the same flight. So joints and velocities are put into a frame that has its origin
at the person and its x axis towards the drone; what the networks learn at one bearing then holds at all of them.
All of it comes from the observation: where the person stands and faces, from the filtered joints.
"""

from typing import Any, TypeAlias

import numpy as np
import torch
from gymnasium.spaces import Box
from numpy.typing import NDArray
from torch import Tensor, nn

from agent.environment.spaces import COORDINATES
from protocol.arrays import Float32Array
from protocol.environment_config import EnvironmentConfig
from protocol.skeleton import JOINT_COUNT, Joint

_REACH = 2.0
"""Metres from a wall or from the keep-out at which its feature begins to rise: some steps' flight."""

_LEFT = [Joint.LEFT_SHOULDER, Joint.LEFT_HIP, Joint.LEFT_EYE, Joint.LEFT_EAR]
_RIGHT = [Joint.RIGHT_SHOULDER, Joint.RIGHT_HIP, Joint.RIGHT_EYE, Joint.RIGHT_EAR]

# The pairs, from right to left, and the nose from the neck; arrays, since a list would be made into one at each call.
_STARTS, _ENDS = np.array([*_RIGHT, Joint.NECK]), np.array([*_LEFT, Joint.NOSE])

_Rows: TypeAlias = NDArray[Any]
"""Of float32, one for each observation; by NumPy's types, a float makes them float64."""

FEATURE_SIZE = 2 + 2 + 3 + 4 + 3 * JOINT_COUNT + JOINT_COUNT + 2 * len(_LEFT) + 2


class Features(nn.Module):
    """Observations (n, 111) to features (n, FEATURE_SIZE), all about 1 in size; nothing in it is learned.

    It stands where skrl has its running scalers: lengths and variances have known ranges here, and a scale that moves
    with the replay would change what an old transition means.

    Computed by NumPy: of the few rows that are acted on, each of torch's operators takes several times as long.
    """

    size = FEATURE_SIZE

    def __init__(self, workspace: EnvironmentConfig) -> None:
        super().__init__()
        self._workspace = workspace

    @classmethod
    def space(cls) -> Box:
        """Of the features of one observation."""
        return Box(-np.inf, np.inf, (cls.size,))

    def forward(self, observations: Tensor, train: bool = False) -> Tensor:
        """Features of a batch. `train` is skrl's word to running scalers; it changes nothing here."""
        return torch.from_numpy(self.of(np.asarray(observations)))

    def of(self, observations: Float32Array) -> Float32Array:
        """Features of a batch, each row's the same to the bit whatever the others are."""
        joints = observations[:, :COORDINATES].reshape(-1, JOINT_COUNT, 3)
        variances = observations[:, COORDINATES : 2 * COORDINATES].reshape(-1, JOINT_COUNT, 3)
        return self.of_seen(joints, variances.sum(2) / 3.0, observations[:, 2 * COORDINATES :])

    def of_seen(self, joints: _Rows, variances: _Rows, drone: _Rows) -> Float32Array:
        """(n, FEATURE_SIZE) of joints (n, 18, 3) in the world, variances (n, 18), and the drone's place (n, 3)."""
        trust = 1.0 / (1.0 + 10.0 * variances)
        person = (joints[:, :, :2] * trust[:, :, None]).sum(1) / trust.sum(1, keepdims=True)
        offset = drone[:, :2] - person
        distance = np.maximum(np.sqrt((offset**2).sum(1, keepdims=True)), 1e-6)
        bearing = offset / distance
        x, y = turned(joints[:, :, 0] - person[:, :1], joints[:, :, 1] - person[:, 1:], bearing)
        around = np.stack([x, y, joints[:, :, 2]], axis=2) * trust[:, :, None]
        parts = [bearing, self._place(drone, distance), self._limits(drone, distance, bearing)]
        parts += [around.reshape(-1, COORDINATES), trust, _facing(around)]
        return np.concatenate(parts, axis=1)

    def _place(self, drone: _Rows, distance: _Rows) -> _Rows:
        """(n, 5) how far the drone is from the person, and where in the workspace, in its own units."""
        space = self._workspace
        middle, half = (space.max_altitude + space.min_altitude) / 2, (space.max_altitude - space.min_altitude) / 2
        place = [distance / space.half_width, 2.0 / distance, drone[:, :2] / space.half_width]
        return np.concatenate([*place, (drone[:, 2:] - middle) / half], axis=1)

    def _limits(self, drone: _Rows, distance: _Rows, bearing: _Rows) -> _Rows:
        """(n, 4) the limits that the drone must not cross, 1 at the limit and 0 from `_REACH` on.

        The walls as a vector towards them in the drone's frame, floor and ceiling as its third component, the keep-out.
        """
        space = self._workspace
        across, height = drone[:, :2], drone[:, 2:]
        room = [space.half_width - np.abs(across), space.max_altitude - height, height - space.min_altitude]
        near = _nearness(np.concatenate([*room, distance - space.keep_out_radius], axis=1))
        walls, ceiling, floor, keep_out = near[:, :2] * np.sign(across), near[:, 2:3], near[:, 3:4], near[:, 4:]
        return np.concatenate([*turned(walls[:, :1], walls[:, 1:], bearing), ceiling - floor, keep_out], axis=1)


class RecentFeatures:
    """`Features` that remembers those of the last observations.

    An observation that is acted on comes twice more soon after: as that after a step, and as that before the next.

    Args:
        size: how many it remembers.
    """

    def __init__(self, features: Features, size: int) -> None:
        self._features = features
        self._size = size
        self._known: dict[bytes, Float32Array] = {}

    def of(self, observations: Float32Array) -> Float32Array:
        """(n, 111) to (n, FEATURE_SIZE)."""
        keys = [observation.tobytes() for observation in observations]
        new = [index for index, key in enumerate(keys) if key not in self._known]
        if new:
            self._known.update(zip([keys[index] for index in new], self._features.of(observations[new]), strict=True))
        features = np.stack([self._known[key] for key in keys])
        for key in list(self._known)[: -self._size]:
            del self._known[key]
        return features


def _facing(around: _Rows) -> _Rows:
    """(n, 10) where the person faces, in the drone's frame, by each pair of left and right joints and the nose.

    Half a metre long at most and shorter the less a pair is trusted; zero before it is seen.
    """
    starts, ends = around.take(_STARTS, axis=1), around.take(_ENDS, axis=1)
    facing = ends[:, :, :2] - starts[:, :, :2]
    np.subtract(ends[:, :-1, 1], starts[:, :-1, 1], out=facing[:, :-1, 0])
    np.subtract(starts[:, :-1, 0], ends[:, :-1, 0], out=facing[:, :-1, 1])
    return facing.reshape(-1, 2 * len(_STARTS))


def _nearness(room: _Rows) -> _Rows:
    """1 where there is no room left, 0 where there are `_REACH` metres of it."""
    return np.minimum(np.maximum(1.0 - room / _REACH, 0.0), 1.5)


def turned(x: _Rows, y: _Rows, bearing: _Rows) -> tuple[_Rows, _Rows]:
    """As `to_drone_frame` turns vectors, horizontally: x and y (n, k) for bearings (n, 2)."""
    cosine, sine = bearing[:, :1], bearing[:, 1:]
    return cosine * x + sine * y, cosine * y - sine * x


def to_drone_frame(vectors: Tensor, bearing: Tensor) -> Tensor:
    """World vectors (…, 3) as seen with x from the person to the drone, y to the left of that, z up."""
    cosine, sine = bearing.split(1, dim=-1)
    x, y, z = vectors.split(1, dim=-1)
    return torch.cat([cosine * x + sine * y, cosine * y - sine * x, z], dim=-1)


def to_world_frame(vectors: Tensor, bearing: Tensor) -> Tensor:
    """The inverse of `to_drone_frame`, on whatever device both are."""
    cosine, sine = bearing.split(1, dim=-1)
    return to_drone_frame(vectors, torch.cat([cosine, -sine], dim=-1))


def to_drone_frames(features: Tensor) -> Tensor:
    """(n, 3, 3) what `to_drone_frame` does, as matrices; their transposes lead back into the world frame."""
    matrices = features.new_zeros(len(features), 3, 3)
    cosine, sine = bearing_of(features).unbind(1)
    matrices[:, 0, 0] = matrices[:, 1, 1] = cosine
    matrices[:, 0, 1], matrices[:, 1, 0] = sine, -sine
    matrices[:, 2, 2] = 1.0
    return matrices


def bearing_of(features: Tensor) -> Tensor:
    """(n, 2) cosine and sine of the drone's bearing from the person."""
    return features[:, :2]
