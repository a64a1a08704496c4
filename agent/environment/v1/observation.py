"""Observations of version 1, number by number.

| numbers | what | unit, bounds |
|---|---|---|
| 0 to 53 | each joint from the drone, x, y, z along the world's axes | m, ±50 |
| 54 to 71 | radius around each joint that holds the true one with probability 0.9 | m, 0 to 25 |
| 72 to 89 | share of an episode since each joint was last seen, 1 before it was | 0 to 1 |
| 90 to 92 | the drone's position in the world | m, ±50 |
| 93 to 95 | its velocity along the world's axes | m/s, ±1 |
| 96 | share of the episode that was flown | 0 to 1 |
| 97 | share of the certain pictures in a row that a success needs | 0 to 1 |
"""

import numpy as np
from gymnasium.spaces import Box

from agent.environment.flight import Flight
from agent.environment.spaces import COORDINATE_LIMIT, COORDINATES
from agent.environment.v1.posterior import radii
from protocol.arrays import Float32Array
from protocol.environment_config import MAX_SPEED, HoverConfig
from protocol.skeleton import JOINT_COUNT

JOINTS = slice(0, COORDINATES)
RADII = slice(COORDINATES, COORDINATES + JOINT_COUNT)
AGES = slice(RADII.stop, RADII.stop + JOINT_COUNT)
POSITION = slice(AGES.stop, AGES.stop + 3)
VELOCITY = slice(POSITION.stop, POSITION.stop + 3)
SHARES = slice(VELOCITY.stop, VELOCITY.stop + 2)

OBSERVATION_SIZE = SHARES.stop

_LARGEST_RADIUS = 25.0
"""Metres; that of the largest variance that an observation of version 0 has."""


def _bounds() -> tuple[Float32Array, Float32Array]:
    highest = np.ones(OBSERVATION_SIZE, np.float32)
    highest[JOINTS] = highest[POSITION] = COORDINATE_LIMIT
    highest[RADII], highest[VELOCITY] = _LARGEST_RADIUS, MAX_SPEED
    lowest = -highest
    for never_negative in (RADII, AGES, SHARES):
        lowest[never_negative] = 0.0
    return lowest, highest


_LOWEST, _HIGHEST = _bounds()


def observation_space() -> Box[np.float32]:
    """Observations (98,), finite on all sides."""
    return Box(_LOWEST, _HIGHEST, dtype=np.float32)


def observation_of(flight: Flight, config: HoverConfig) -> Float32Array:
    """(98,) the policy's observation, cut to the space's bounds."""
    seen = np.concatenate(
        [
            (flight.filter.mean - flight.position).ravel(),
            radii(flight.filter.variance),
            flight.unseen / config.episode_steps,
            flight.position,
            flight.velocity,
            [flight.steps / config.episode_steps, flight.certain_pictures / config.certain_pictures],
        ]
    )
    return np.clip(seen, _LOWEST, _HIGHEST).astype(np.float32)
