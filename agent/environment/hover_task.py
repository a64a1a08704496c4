"""What the versions of Hover differ in: where a flight begins, what a policy sees, what it is rewarded for.

A task holds its configuration and nothing else: a flight's future depends on the `Flight` alone.
"""

from typing import Protocol

import numpy as np
from gymnasium.spaces import Box

from agent.environment.flight import Flight, move, succeeded, take_off, with_estimate, with_reward
from agent.environment.spaces import observation_of, observation_space
from protocol.arrays import Float32Array, Float64Array
from protocol.environment_config import EnvironmentConfig
from protocol.pose_estimate import PoseEstimate
from protocol.scene import Scene


class HoverTask(Protocol):
    """One version of Hover; see the functions of `agent.environment.flight`, which are version 0's.

    Attributes:
        in_metres: whether its uncertainty is an expected error in metres.
    """

    in_metres: bool

    @property
    def config(self) -> EnvironmentConfig:
        """Of the environment."""
        ...

    @property
    def success_threshold(self) -> float:
        """Of the uncertainty, where an evaluation says when a flight succeeds."""
        ...

    def observation_space(self) -> Box[np.float32]:
        """Of one drone."""
        ...

    def take_off(self, seed: int, scene: Scene) -> Flight:
        """An episode before its first picture."""
        ...

    def move(self, flight: Flight, velocity: Float64Array) -> Flight:
        """The flight after its drone flew `velocity` (3,) m/s for a step; its outcome is settled by that."""
        ...

    def with_estimate(self, flight: Flight, estimate: PoseEstimate) -> Flight:
        """The flight after a picture."""
        ...

    def with_reward(self, flight: Flight) -> tuple[Flight, float]:
        """The flight with the reward of its last step added to its total, and that reward."""
        ...

    def observation(self, flight: Flight) -> Float32Array:
        """What the policy sees."""
        ...

    def uncertainty(self, flight: Flight) -> float:
        """Of the last picture, in the version's own unit."""
        ...

    def succeeded(self, flight: Flight) -> bool:
        """Whether a flight that is over succeeded."""
        ...


class HoverV0:
    """`vantage/Hover-v0`, the thesis's (section 4.3.1)."""

    in_metres = False

    def __init__(self, config: EnvironmentConfig) -> None:
        self.config = config

    @property
    def success_threshold(self) -> float:
        """Weighted over the upper body, 0 to 10."""
        return self.config.success_threshold

    def observation_space(self) -> Box[np.float32]:
        """Observations (111,)."""
        return observation_space()

    def take_off(self, seed: int, scene: Scene) -> Flight:
        """See `HoverTask`."""
        return take_off(self.config, seed, scene)

    def move(self, flight: Flight, velocity: Float64Array) -> Flight:
        """See `HoverTask`."""
        return move(self.config, flight, velocity)

    def with_estimate(self, flight: Flight, estimate: PoseEstimate) -> Flight:
        """See `HoverTask`."""
        return with_estimate(flight, estimate)

    def with_reward(self, flight: Flight) -> tuple[Flight, float]:
        """See `HoverTask`."""
        return with_reward(self.config, flight)

    def observation(self, flight: Flight) -> Float32Array:
        """See `agent.environment.spaces`."""
        return observation_of(flight)

    def uncertainty(self, flight: Flight) -> float:
        """Weighted over the upper body, 0 to 10."""
        return flight.uncertainty

    def succeeded(self, flight: Flight) -> bool:
        """Whether it did not crash, and its last uncertainty is below the configured threshold."""
        return succeeded(flight.outcome, flight.uncertainty, self.config.success_threshold)
