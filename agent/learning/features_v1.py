"""The features of Hover-v1's observations: those of version 0, and what version 1 sees beside that."""

import numpy as np

from agent.environment.v1.observation import AGES, JOINTS, POSITION, RADII, SHARES, VELOCITY
from agent.learning.features import FEATURE_SIZE, Features, turned
from protocol.arrays import Float32Array
from protocol.environment_config import EnvironmentConfig, HoverConfig
from protocol.skeleton import JOINT_COUNT

_DEVIATIONS = 2.5
"""In a radius that holds a joint with probability 0.9, where it is equally uncertain along all axes."""

_LEAST_RADIUS = 0.001
"""Metres."""


class FeaturesV1(Features):
    """Observations (n, 98) to features (n, `size`), all about 1 in size; see `Features`."""

    size = FEATURE_SIZE + 2 * JOINT_COUNT + 3 + 2

    def of(self, observations: Float32Array) -> Float32Array:
        """Features of a batch, each row's the same to the bit whatever the others are."""
        drone, radius = observations[:, POSITION], observations[:, RADII]
        joints = observations[:, JOINTS].reshape(-1, JOINT_COUNT, 3) + drone[:, None]
        known = self.of_seen(joints, (radius / _DEVIATIONS) ** 2, drone)
        velocity = observations[:, VELOCITY]
        across = turned(velocity[:, :1], velocity[:, 1:2], known[:, :2])
        # From 0 at a metre to 1 at a centimetre.
        certainty = -0.5 * np.log10(np.maximum(radius, _LEAST_RADIUS))
        others = [certainty, observations[:, AGES], *across, velocity[:, 2:], observations[:, SHARES]]
        return np.concatenate([known, *others], axis=1).astype(np.float32)


def make_features(config: EnvironmentConfig) -> Features:
    """Of the version of Hover that a configuration is of."""
    return FeaturesV1(config) if isinstance(config, HoverConfig) else Features(config)
