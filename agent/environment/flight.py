"""One episode, step by step, as plain values.

An episode's future depends on its `Flight` alone: an episode continues from a stored one as if never interrupted.
A step has two halves: the drone moves, which settles whether the flight is over, and then the person's pose is
estimated. A flight that ends by coming too close or leaving takes no more pictures: its filter stays as it was.
"""

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from agent.environment.reward import step_reward
from agent.environment.workspace import moved, outcome_of, random_start
from protocol.arrays import Float64Array
from protocol.camera import Camera, CameraPose, Intrinsics, Vector3
from protocol.environment_config import EnvironmentConfig
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.records import Outcome
from protocol.scene import Scene
from protocol.skeleton import JOINT_COUNT, weighted_uncertainty

_START = 0x57A27
"""Separates the random stream of starts from the one that draws the scene of the same seed."""


class Flight(Struct, frozen=True, eq=False, kw_only=True):
    """An episode under way.

    Attributes:
        seed: the episode's; its scene and its start follow from it.
        position: of the drone, world frame, metres.
        filter: after the last picture.
        quality: (18,) of each joint in the last picture.
        steps: flown so far.
        total_reward: collected so far.
        velocity: that the last step was flown with, m/s; version 0 leaves it at zero, and what follows as well.
        unseen: (18,) pictures since each joint was last detected.
        certain_pictures: the last ones in a row that were certain enough for a success.
    """

    seed: int
    scene: Scene
    position: Vector3
    filter: FilterState
    quality: Float64Array
    steps: int = 0
    total_reward: float = 0.0
    outcome: Outcome = "flying"
    velocity: Vector3 = (0.0, 0.0, 0.0)
    unseen: Float64Array = field(default_factory=lambda: np.zeros(JOINT_COUNT))
    certain_pictures: int = 0

    @property
    def over(self) -> bool:
        """Whether there is no next step."""
        return self.outcome != "flying"

    @property
    def ended_badly(self) -> bool:
        """Whether the drone came too close to the person or left the workspace."""
        return self.outcome in ("too_close", "out_of_workspace")

    @property
    def takes_picture(self) -> bool:
        """Whether its last step ends with a picture."""
        return self.outcome in ("flying", "truncated")

    @property
    def terminated(self) -> bool:
        """Whether it ended by itself, and not by the time limit."""
        return self.ended_badly or self.outcome == "succeeded"

    @property
    def uncertainty(self) -> float:
        """Weighted uncertainty of the upper body in the last picture, 0 to 10."""
        return weighted_uncertainty(self.quality)


def take_off(config: EnvironmentConfig, seed: int, scene: Scene) -> Flight:
    """An episode before its first picture, started where its seed says."""
    return Flight(
        seed=seed,
        scene=scene,
        position=random_start(config, scene.position, np.random.default_rng((seed, _START))),
        filter=FilterState.initial(mean=(0.0, 0.0, config.target_height)),
        quality=np.zeros(JOINT_COUNT),
    )


def move(config: EnvironmentConfig, flight: Flight, velocity: Float64Array) -> Flight:
    """The flight after its drone flew `velocity` (3,) m/s for a step; its outcome is settled by that."""
    position = moved(flight.position, velocity, config.step_duration)
    outcome = outcome_of(config, flight.position, position, flight.scene.position)
    steps = flight.steps + 1
    if outcome == "flying" and steps >= config.episode_steps:
        outcome = "truncated"
    return replace(flight, position=position, outcome=outcome, steps=steps)


def with_estimate(flight: Flight, estimate: PoseEstimate) -> Flight:
    """The flight after a picture, whose estimate brings the filter and the quality."""
    return replace(flight, filter=estimate.filter, quality=estimate.quality)


def with_reward(config: EnvironmentConfig, flight: Flight) -> tuple[Flight, float]:
    """The flight with the reward of its last step added to its total, and that reward."""
    reward = step_reward(
        config, flight.scene, flight.position, flight.filter.variance, flight.steps, ended_badly=flight.ended_badly
    )
    return replace(flight, total_reward=flight.total_reward + reward), reward


def camera_of(config: EnvironmentConfig, flight: Flight) -> Camera:
    """The drone's camera, turned to the person."""
    x, y = flight.scene.position
    optics = config.camera
    return Camera(
        pose=CameraPose(position=flight.position, target=(x, y, config.target_height)),
        intrinsics=Intrinsics.from_horizontal_fov(optics.width, optics.height, optics.horizontal_fov),
        depth_noise=optics.depth_noise,
    )


def succeeded(outcome: Outcome, uncertainty: float, threshold: float) -> bool:
    """Whether a flight succeeded: it did not crash, and its last uncertainty is below `threshold`."""
    return outcome == "truncated" and uncertainty < threshold
