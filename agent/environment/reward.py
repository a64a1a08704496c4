"""The reward of a step (thesis, section 4.3.1).

Early in an episode the filter's uncertainty falls whatever the drone does, so the way to the point in front of the
person counts as well; by the last step only the uncertainty does.
"""

import math

from protocol.arrays import Float64Array
from protocol.camera import Vector3
from protocol.environment_config import EnvironmentConfig
from protocol.scene import Scene


def uncertainty_weight(step: int, steps: int, beta: float) -> float:
    """The share of uncertainty in the reward of step 1 to `steps`: α, from just over 1 - 1/β to 1."""
    return (1 - 1 / beta) + step / (beta * steps)


def front_point(config: EnvironmentConfig, scene: Scene) -> Vector3:
    """The point in front of the person that early rewards draw the drone to, in the world frame, metres."""
    (x, y), (facing_x, facing_y) = scene.position, scene.facing
    distance = config.front_distance
    return x + distance * facing_x, y + distance * facing_y, config.front_height


def step_reward(
    config: EnvironmentConfig, scene: Scene, position: Vector3, variance: Float64Array, step: int, *, ended_badly: bool
) -> float:
    """R = -(α R1 + (1 - α) R2), and the penalty on top of it where the flight ended by coming too close or leaving.

    Args:
        position: of the drone after the step, metres.
        variance: (18, 3) diagonal of the filter's posterior covariance, m²; R1 is its sum, scaled.
        step: number of the step, the first is 1.
    """
    weight = uncertainty_weight(step, config.episode_steps, config.beta)
    uncertainty = config.uncertainty_scale * float(variance.sum())
    distance = config.distance_scale * math.dist(position, front_point(config, scene))
    return -(weight * uncertainty + (1 - weight) * distance) + (config.penalty if ended_badly else 0.0)
