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
        return torch.cat([bearing, place, limits, around.flatten(1), trust, _facing(around, trust).flatten(1)], dim=1)

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
        walls = _nearness(space.half_width - drone[:, :2].abs()) * drone[:, :2].sign()
        upright = _nearness(space.highest - drone[:, 2:]) - _nearness(drone[:, 2:] - space.lowest)
        towards = to_drone_frame(torch.cat([walls, upright], dim=1), bearing)
        return torch.cat([towards, _nearness(distance - space.keep_out)], dim=1)


def _nearness(room: Tensor) -> Tensor:
    """1 where there is no room left, 0 where there are `_REACH` metres of it."""
    return (1.0 - room / _REACH).clamp(0.0, 1.5)


def to_drone_frame(vectors: Tensor, bearing: Tensor) -> Tensor:
    """World vectors (…, 3) as seen with x from the person to the drone, y to the left of that, z up."""
    cosine, sine = bearing[..., :1], bearing[..., 1:2]
    x, y, z = vectors[..., :1], vectors[..., 1:2], vectors[..., 2:]
    return torch.cat([cosine * x + sine * y, cosine * y - sine * x, z], dim=-1)


def to_world_frame(vectors: Tensor, bearing: Tensor) -> Tensor:
    """The inverse of `to_drone_frame`."""
    return to_drone_frame(vectors, bearing * torch.tensor([1.0, -1.0]))


def to_drone_frames(features: Tensor) -> Tensor:
    """(n, 3, 3) what `to_drone_frame` does, as matrices; their transposes lead back into the world frame."""
    matrices = torch.zeros(len(features), 3, 3, dtype=features.dtype)
    cosine, sine = bearing_of(features).unbind(1)
    matrices[:, 0, 0] = matrices[:, 1, 1] = cosine
    matrices[:, 0, 1], matrices[:, 1, 0] = sine, -sine
    matrices[:, 2, 2] = 1.0
    return matrices


def bearing_of(features: Tensor) -> Tensor:
    """(n, 2) cosine and sine of the drone's bearing from the person."""
    return features[:, :2]


def _facing(around: Tensor, trust: Tensor) -> Tensor:
    """(n, 5, 2) where the person faces, in the drone's frame, by each pair of left and right joints and by the nose.

    Half a metre long at most and shorter the less a pair is trusted; zero before it is seen.
    """
    across = around[:, _LEFT, :2] - around[:, _RIGHT, :2]
    nose = around[:, Joint.NOSE, :2] - around[:, Joint.NECK, :2]
    return torch.cat([torch.stack([across[..., 1], -across[..., 0]], dim=2), nose[:, None]], dim=1)
