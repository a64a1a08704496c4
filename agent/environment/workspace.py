"""The space that the drone may fly in, and how it moves there (thesis, sections 4.3.1 and 4.3.4).

The keep-out around the person is a cylinder, not a sphere: it also rules out flying over the person's head, where a
fall or the downwash would hit them and where the camera, always turned to the person, would look straight down.
"""

import math

import numpy as np

from protocol.arrays import Float64Array
from protocol.camera import Vector3
from protocol.environment_config import MAX_SPEED, EnvironmentConfig
from protocol.records import Outcome


def moved(position: Vector3, velocity: Float64Array, duration: float) -> Vector3:
    """Where a drone is after flying `velocity` (3,) for `duration` seconds; each component is cut to ±`MAX_SPEED`."""
    cut = (min(max(speed, -MAX_SPEED), MAX_SPEED) for speed in velocity.tolist())
    x, y, z = (along + speed * duration for along, speed in zip(position, cut, strict=True))
    return x, y, z


def contains(config: EnvironmentConfig, position: Vector3) -> bool:
    """Whether a position is inside the workspace, its walls included."""
    x, y, z = position
    return max(abs(x), abs(y)) <= config.half_width and config.min_altitude <= z <= config.max_altitude


def closest_approach(start: Vector3, end: Vector3, person: tuple[float, float]) -> float:
    """The least horizontal distance, in metres, between a person and the straight way from `start` to `end`."""
    from_x, from_y = start[0] - person[0], start[1] - person[1]
    way_x, way_y = end[0] - start[0], end[1] - start[1]
    length_squared = way_x**2 + way_y**2
    along = -(from_x * way_x + from_y * way_y) / length_squared if length_squared > 0 else 0.0
    along = min(max(along, 0.0), 1.0)
    return math.hypot(from_x + along * way_x, from_y + along * way_y)


def outcome_of(config: EnvironmentConfig, start: Vector3, end: Vector3, person: tuple[float, float]) -> Outcome:
    """The outcome of a straight flight from `start` to `end`, without the time limit."""
    if closest_approach(start, end, person) < config.keep_out_radius:
        return "too_close"
    return "flying" if contains(config, end) else "out_of_workspace"


def random_start(config: EnvironmentConfig, person: tuple[float, float], rng: np.random.Generator) -> Vector3:
    """A position from which no first step ends the flight, uniform over all such positions."""
    reach = MAX_SPEED * config.step_duration
    half_width = config.half_width - reach
    low = (-half_width, -half_width, config.min_altitude + reach)
    high = (half_width, half_width, config.max_altitude - reach)
    while True:
        x, y, z = rng.uniform(low, high)
        if np.hypot(x - person[0], y - person[1]) >= config.start_clearance:
            return float(x), float(y), float(z)
