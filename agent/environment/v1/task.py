"""`vantage/Hover-v1`: the rewards, the end and the observations of a flight, all of them from what is estimated.

A flight succeeds once the hand to hand over to and the upper body were certain in several pictures in a row. That is
known after a picture, and what ends a flight must be known before the next one is taken (`agent.environment.flight`).
So the step after the last of these pictures ends the flight, wherever it leads; it takes no picture and costs nothing.
"""

import math

import numpy as np
from gymnasium.spaces import Box
from msgspec.structs import replace

from agent.environment.flight import Flight, move, take_off, with_estimate
from agent.environment.reward import uncertainty_weight
from agent.environment.v1.observation import observation_of, observation_space
from agent.environment.v1.person import Person
from agent.environment.v1.posterior import expected_errors, over_upper_body, radii
from protocol.arrays import Float32Array, Float64Array
from protocol.environment_config import HoverConfig
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.scene import Scene
from protocol.skeleton import JOINT_COUNT


class HoverV1:
    """See `HoverTask`; lengths in metres."""

    in_metres = True

    def __init__(self, config: HoverConfig) -> None:
        self.config = config

    @property
    def success_threshold(self) -> float:
        """The upper body's; metres."""
        return self.config.body_radius

    def observation_space(self) -> Box[np.float32]:
        """Observations (98,); see `agent.environment.v1.observation`."""
        return observation_space()

    def take_off(self, seed: int, scene: Scene) -> Flight:
        """With a filter that believes the lifter's variances."""
        return replace(
            take_off(self.config, seed, scene),
            filter=FilterState.initial(mean=(0.0, 0.0, self.config.target_height), rule="variance"),
            unseen=np.full(JOINT_COUNT, float(self.config.episode_steps)),
        )

    def move(self, flight: Flight, velocity: Float64Array) -> Flight:
        """The flight after a step; see the module."""
        if flight.certain_pictures >= self.config.certain_pictures:
            return replace(flight, outcome="succeeded", steps=flight.steps + 1)
        moved = move(self.config, flight, velocity)
        x, y, z = ((np.array(moved.position) - flight.position) / self.config.step_duration).tolist()
        return replace(moved, velocity=(x, y, z))

    def with_estimate(self, flight: Flight, estimate: PoseEstimate) -> Flight:
        """With the ages of the joints, and how many pictures in a row were certain."""
        seen = np.isfinite(estimate.keypoints[:, 0])
        observed = replace(with_estimate(flight, estimate), unseen=np.where(seen, 0.0, flight.unseen + 1.0))
        certain = observed.certain_pictures + 1 if self.is_certain(observed) else 0
        return replace(observed, certain_pictures=certain)

    def with_reward(self, flight: Flight) -> tuple[Flight, float]:
        """R = -(α R1 + (1 - α) R2), and the penalty; nothing for the step that ends a success."""
        reward = 0.0 if flight.outcome == "succeeded" else self._reward(flight)
        return replace(flight, total_reward=flight.total_reward + reward), reward

    def observation(self, flight: Flight) -> Float32Array:
        """See `agent.environment.v1.observation`."""
        return observation_of(flight, self.config)

    def uncertainty(self, flight: Flight) -> float:
        """The expected error, weighted over the upper body, metres."""
        return over_upper_body(expected_errors(flight.filter.variance))

    def succeeded(self, flight: Flight) -> bool:
        """Whether the flight ended by being certain."""
        return flight.outcome == "succeeded"

    def is_certain(self, flight: Flight) -> bool:
        """Whether the hand to hand over to and the upper body are known well enough after the last picture."""
        radius = radii(flight.filter.variance)
        wrist = person_in(flight).handover_wrist(flight.position)
        return bool(
            flight.filter.seen[wrist]
            and radius[wrist] < self.config.wrist_radius
            and over_upper_body(radius) < self.config.body_radius
        )

    def _reward(self, flight: Flight) -> float:
        config = self.config
        weight = uncertainty_weight(flight.steps, config.episode_steps, config.beta)
        error = min(config.error_scale * self.uncertainty(flight), 1.0)
        distance = config.distance_scale * self._distance(flight)
        return -(weight * error + (1 - weight) * distance) + (config.penalty if flight.ended_badly else 0.0)

    def _distance(self, flight: Flight) -> float:
        """Metres from the drone to the point in front of the person as estimated.

        While it is not known where the person faces, as far as that point may be: on their other side.
        """
        config, person = self.config, person_in(flight)
        front = person.front_point(config.front_distance, config.front_height)
        if front is not None:
            return math.dist(flight.position, front)
        x, y = person.place or (0.0, 0.0)
        return math.dist(flight.position, (x, y, config.front_height)) + config.front_distance


def person_in(flight: Flight) -> Person:
    """The person as the flight's filter knows them."""
    return Person(flight.filter.mean, flight.filter.seen)
