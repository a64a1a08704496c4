"""The 111 numbers of an observation as the networks take them: seen from the person, turned to the drone.

A flight turned about the person is the same flight. So joints and velocities are put into a frame that has its origin
at the person and its x axis towards the drone; what the networks learn at one bearing then holds at all of them.
All of it comes from the observation: where the person stands and faces, from the filtered joints.
"""

import torch
from torch import Tensor, nn

from agent.spaces import COORDINATES
from protocol.config import EnvironmentConfig
from protocol.skeleton import JOINT_COUNT, Joint

_REACH = 2.0
"""Metres from a wall or from the keep-out at which it begins to be felt: some steps' flight."""

_LEFT = [Joint.LEFT_SHOULDER, Joint.LEFT_HIP, Joint.LEFT_EYE, Joint.LEFT_EAR]
_RIGHT = [Joint.RIGHT_SHOULDER, Joint.RIGHT_HIP, Joint.RIGHT_EYE, Joint.RIGHT_EAR]

FEATURE_SIZE = 2 + 2 + 3 + 4 + 3 * JOINT_COUNT + JOINT_COUNT + 2 * len(_LEFT) + 2


class Features(nn.Module):
    """Observations (n, 111) to features (n, FEATURE_SIZE), all about 1 in size; nothing in it is learned.

    It stands where skrl has its running scalers: lengths and variances have known ranges here, and a scale that moves
    with the replay would change what an old transition means.
    """

    def __init__(self, workspace: EnvironmentConfig) -> None:
        super().__init__()
        self._workspace = workspace
        # Tensors, since a list would be made into one at each call.
        self._left, self._right = torch.tensor(_LEFT), torch.tensor(_RIGHT)

    def forward(self, observations: Tensor, train: bool = False) -> Tensor:
        """Features of a batch. `train` is skrl's word to running scalers; it changes nothing here."""
        joints = observations[:, :COORDINATES].unflatten(1, (JOINT_COUNT, 3))
        variance = observations[:, COORDINATES : 2 * COORDINATES].unflatten(1, (JOINT_COUNT, 3)).mean(2)
        drone = observations[:, 2 * COORDINATES :]
        trust = 1.0 / (1.0 + 10.0 * variance)
        person = (joints[:, :, :2] * trust[:, :, None]).sum(1) / trust.sum(1, keepdim=True)
        offset = drone[:, :2] - person
        distance = offset.norm(dim=1, keepdim=True).clamp_min(1e-6)
        bearing = offset / distance
        around = torch.cat([joints[:, :, :2] - person[:, None], joints[:, :, 2:]], dim=2)
        around = to_drone_frame(around, bearing[:, None]) * trust[:, :, None]
        place = self._place(drone, distance)
        limits = self._limits(drone, distance, bearing)
        facing = self._facing(around)
        return torch.cat([bearing, place, limits, around.flatten(1), trust, facing.flatten(1)], dim=1)

    def _place(self, drone: Tensor, distance: Tensor) -> Tensor:
        """(n, 5) how far the drone is from the person, and where in the workspace, in its own units."""
        space = self._workspace
        middle, half = (space.highest + space.lowest) / 2, (space.highest - space.lowest) / 2
        height = (drone[:, 2:] - middle) / half
        return torch.cat([distance / space.half_width, 2.0 / distance, drone[:, :2] / space.half_width, height], dim=1)

    def _limits(self, drone: Tensor, distance: Tensor, bearing: Tensor) -> Tensor:
        """(n, 4) what the drone must not fly into, 1 at the limit and 0 from `_REACH` on.

        The walls as a vector towards them in the drone's frame, floor and ceiling as its third component, the keep-out.
        """
        space = self._workspace
        across, height = drone.split((2, 1), dim=1)
        room = [space.half_width - across.abs(), space.highest - height, height - space.lowest]
        near = _nearness(torch.cat([*room, distance - space.keep_out], dim=1))
        walls, ceiling, floor, keep_out = near.split((2, 1, 1, 1), dim=1)
        towards = to_drone_frame(torch.cat([walls * across.sign(), ceiling - floor], dim=1), bearing)
        return torch.cat([towards, keep_out], dim=1)

    def _facing(self, around: Tensor) -> Tensor:
        """(n, 5, 2) where the person faces, in the drone's frame, by each pair of left and right joints and the nose.

        Half a metre long at most and shorter the less a pair is trusted; zero before it is seen.
        """
        flat = around[:, :, :2]
        across = flat.index_select(1, self._left) - flat.index_select(1, self._right)
        nose = flat[:, Joint.NOSE] - flat[:, Joint.NECK]
        return torch.cat([torch.stack([across[..., 1], -across[..., 0]], dim=2), nose[:, None]], dim=1)


def _nearness(room: Tensor) -> Tensor:
    """1 where there is no room left, 0 where there are `_REACH` metres of it."""
    return (1.0 - room / _REACH).clamp(0.0, 1.5)


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
