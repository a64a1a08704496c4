"""A learned lifter: the positions of a body's joints in space, and how far off each may be."""

from typing import NamedTuple

import numpy as np

from perception_worker.lifter.network import LifterNetwork
from perception_worker.lifter.stored import Certainty, Provenance, StoredLifter, unpacked
from perception_worker.lifter.tokens import Seen, Tokens, mirrored, points_of, tokens_of
from perception_worker.networks.network_setting import NetworkSetting
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import Camera, world_to_camera
from protocol.errors import ArtifactDamaged
from protocol.pose_estimate import Evidence
from protocol.skeleton import JOINT_COUNT, MIRRORED

LEAST_FOUND = 3
"""Joints of a person that have to be found; fewer don't determine a body."""

_ACROSS, _AHEAD = 3, 4
"""Of a network's outputs: the logarithms of the scales across a joint's ray and along it."""


class Lifted(NamedTuple):
    """One person; NaN where there is none.

    Attributes:
        points: (18, 3) world frame, metres.
        expected_error, radius: (18,) metres.
        variance: (18, 3) of the points along the world's axes, m².
    """

    points: Float64Array
    expected_error: Float64Array
    radius: Float64Array
    variance: Float64Array


class Estimate(NamedTuple):
    """n frames of one person each, in the cameras' frames.

    Attributes:
        points: (n, 18, 3) metres.
        across, ahead: (n, 18) metres, standard deviations along an axis across a joint's ray, and along the ray.
        rays: (n, 18, 3) unit vectors.
    """

    points: Float64Array
    across: Float64Array
    ahead: Float64Array
    rays: Float64Array

    @property
    def scale(self) -> Float64Array:
        """(n, 18) metres, the root of all three axes' variances."""
        return np.sqrt(2.0 * self.across**2 + self.ahead**2)


class Lifter:
    """Lifts one person at a time; may be used by several threads at once.

    Raises:
        ArtifactDamaged: what was stored is damaged, or of another version.
    """

    def __init__(self, stored: StoredLifter) -> None:
        self.setting: NetworkSetting = stored.setting
        self.provenance: Provenance = stored.provenance
        self._network = LifterNetwork(stored.shape, unpacked(stored))
        # By whether a joint was found: no, yes.
        self._error = _by_found(stored.inferred, stored.seen, "error")
        self._radius = _by_found(stored.inferred, stored.seen, "radius")
        if not stored.unmeasured >= 1.0:
            raise ArtifactDamaged("a lifter is not surer of a person whose depth was not measured")
        self._unmeasured = stored.unmeasured

    def lift(self, keypoints: Float64Array, height: Float64Array, evidence: Evidence, camera: Camera) -> Lifted:
        """Place all joints of a person in the world.

        Args:
            keypoints: (18, 2) pixels x and y of the whole picture, NaN where there is none.
            height: (18,) of their peaks, 0 to 1.
        """
        found = np.isfinite(keypoints[:, 0])
        if np.count_nonzero(found) < LEAST_FOUND:
            nowhere = np.full((JOINT_COUNT, 3), np.nan)
            return Lifted(nowhere, nowhere[:, 0], nowhere[:, 0], nowhere)
        transform = world_to_camera(camera.pose)
        tokens = tokens_of(_seen(keypoints, height, evidence, camera, transform[1:3, 2]))
        estimate = estimate_of(self._network, tokens)
        scale = estimate.scale[0] * (1.0 if tokens.measured[0] else self._unmeasured)
        to_world = transform[:3, :3]
        ahead = (estimate.rays[0] @ to_world) ** 2
        return Lifted(
            points=(estimate.points[0] - transform[:3, 3]) @ to_world,
            expected_error=scale * _chosen(self._error, found),
            radius=scale * _chosen(self._radius, found),
            variance=ahead * estimate.ahead[0, :, None] ** 2 + (1.0 - ahead) * estimate.across[0, :, None] ** 2,
        )

    def estimate(self, seen: Seen) -> Estimate:
        """Place all joints of many people at once, in the cameras' frames.

        Args:
            seen: frames in each of which at least `LEAST_FOUND` joints were found.
        """
        return estimate_of(self._network, tokens_of(seen))


def estimate_of(network: LifterNetwork, tokens: Tokens) -> Estimate:
    """A network's output for frames, averaged with that for their mirror images: so neither side is preferred."""
    told = network(np.concatenate([tokens.values, mirrored(tokens.values)]))
    straight, turned = told[: len(tokens.values)], told[len(tokens.values) :][:, MIRRORED]
    turned[:, :, 0] *= -1.0
    outputs = ((straight + turned) / 2).astype(np.float64)
    slopes = np.concatenate([tokens.rays, np.ones((*tokens.rays.shape[:2], 1))], axis=2)
    return Estimate(
        points=points_of(tokens, outputs[:, :, :3]),
        # Of Laplace distributions, whose scales the network gives.
        across=np.sqrt(3.0) * np.exp(outputs[:, :, _ACROSS]),
        ahead=np.sqrt(2.0) * np.exp(outputs[:, :, _AHEAD]),
        rays=slopes / np.sqrt((slopes**2).sum(axis=2, keepdims=True)),
    )


def _seen(keypoints: Float64Array, height: Float64Array, evidence: Evidence, camera: Camera, up: Float64Array) -> Seen:
    intrinsics = camera.intrinsics
    rays = (keypoints - (intrinsics.cx, intrinsics.cy)) / (intrinsics.fx, intrinsics.fy)
    return Seen(
        rays=rays[None],
        height=height[None],
        narrow=evidence.narrow[None],
        wide=evidence.wide[None],
        up=up[None],
        focal=np.array([intrinsics.fx]),
    )


def _by_found(inferred: Certainty, seen: Certainty, name: str) -> Float64Array:
    factors = np.array([getattr(inferred, name), getattr(seen, name)])
    if not (np.isfinite(factors) & (factors > 0.0)).all():
        raise ArtifactDamaged(f"the lifter's factors for {name} are not all finite and above 0")
    return factors


def _chosen(factors: Float64Array, found: BoolArray) -> Float64Array:
    return np.where(found, factors[1], factors[0])
