"""Observations and actions of a policy, as numbers and as Gymnasium's spaces."""

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from agent.environment.flight import Flight
from protocol.arrays import Float32Array, Float64Array
from protocol.environment_config import MAX_SPEED
from protocol.errors import InvalidInput
from protocol.skeleton import JOINT_COUNT

COORDINATES = 3 * JOINT_COUNT
OBSERVATION_SIZE = 2 * COORDINATES + 3
ACTION_SIZE = 3

COORDINATE_LIMIT = 50.0
"""Metres. Depth is cut at 15 m and the workspace at 9, so no joint is found farther out."""

VARIANCE_LIMIT = 100.0
"""m². A joint that is never seen stays far below it in 100 steps."""

_HIGHEST = np.repeat((COORDINATE_LIMIT, VARIANCE_LIMIT, COORDINATE_LIMIT), (COORDINATES, COORDINATES, 3))
_LOWEST = np.repeat((-COORDINATE_LIMIT, 0.0, -COORDINATE_LIMIT), (COORDINATES, COORDINATES, 3))


def observation_space() -> Box[np.float32]:
    """Observations (111,), finite on all sides."""
    return Box(_LOWEST.astype(np.float32), _HIGHEST.astype(np.float32), dtype=np.float32)


def action_space() -> Box[np.float32]:
    """Velocities (3,) in the world frame, m/s."""
    return Box(-MAX_SPEED, MAX_SPEED, (ACTION_SIZE,), np.float32)


def observation_of(flight: Flight) -> Float32Array:
    """(111,) the policy's observation: 54 filtered coordinates, 54 posterior variances, the drone's position.

    In m and m², cut to the observation space's bounds. Source: thesis, section 4.3.1.
    """
    seen = np.concatenate([flight.filter.mean.ravel(), flight.filter.variance.ravel(), flight.position])
    return np.minimum(np.maximum(seen, _LOWEST), _HIGHEST).astype(np.float32)


def require_actions(actions: ArrayLike, shape: tuple[int, ...]) -> Float64Array:
    """Return `actions` as an array of `shape`; values beyond the limits are allowed, since the drone cuts them.

    Raises:
        InvalidInput: another shape, no numbers, or a value that is not finite.
    """
    try:
        velocities = np.asarray(actions, np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"an action is {ACTION_SIZE} velocities in m/s, not {actions!r}") from error
    if velocities.shape != shape:
        raise InvalidInput(f"actions have the shape {velocities.shape}, not {shape}")
    if not np.isfinite(velocities).all():
        raise InvalidInput(f"an action must be finite, not {velocities.tolist()}")
    return velocities
