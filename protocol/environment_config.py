"""The configuration of `vantage/Hover-v0` and of `vantage/Hover-v1`."""

import math
from typing import Annotated

from msgspec import Meta

from protocol.camera import DepthNoise
from protocol.config_bounds import (
    CameraSide,
    Count,
    Drones,
    FieldOfView,
    Length,
    Negative,
    Positive,
    StepDuration,
)
from protocol.config_section import Section
from protocol.errors import InvalidConfig, LimitExceeded
from protocol.limits import require_picture_travels

MAX_SPEED = 1.0
"""The largest speed of a drone along each axis, in m/s."""


class CameraConfig(Section, frozen=True):
    """The drone's camera; `horizontal_fov` in degrees."""

    width: CameraSide = 640
    height: CameraSide = 480
    horizontal_fov: FieldOfView = 70.0
    depth_noise: DepthNoise = "none"

    def __post_init__(self) -> None:
        try:
            require_picture_travels(self.width, self.height)
        except LimitExceeded as error:
            raise InvalidConfig(f"environment.camera.width, height: {error}") from error


class EnvironmentConfig(Section, frozen=True):
    """`vantage/Hover-v0` (thesis, section 4.3.1). Lengths in metres, times in seconds.

    Attributes:
        beta: weight of uncertainty against distance in the reward grows from 1 - 1/beta to 1 over an episode.
        num_envs: number of drones, each with its own episodes.
        episode_steps: length of an episode.
        step_duration: for which one action is flown.
        front_distance, front_height: of the point in front of the person, above the ground, that early rewards favour.
        target_height: of the point that the camera looks at, above the ground where the person stands.
        uncertainty_scale: factor on the trace of the filter's posterior covariance, R1 of the reward.
        distance_scale: factor on the distance to the point in front, R2 of the reward.
        penalty: added to the reward of a step that comes too close or leaves the workspace.
        keep_out_radius: distance from the person below which an episode ends.
        half_width, min_altitude, max_altitude: of the workspace.
        success_threshold: weighted uncertainty (0 to 10) below which the end of an episode counts as a success.
    """

    num_envs: Drones = 4
    episode_steps: Count = 100
    step_duration: StepDuration = 0.5
    beta: Annotated[float, Meta(gt=1, le=1e6)] = 2.0
    front_distance: Length = 2.5
    front_height: Length = 1.6
    target_height: Length = 1.2
    uncertainty_scale: Positive = 1 / 54
    distance_scale: Positive = 1 / 9
    penalty: Negative = -100.0
    keep_out_radius: Length = 1.5
    half_width: Length = 9.0
    min_altitude: Length = 0.5
    max_altitude: Length = 4.0
    success_threshold: Positive = 1.6
    camera: CameraConfig = CameraConfig()

    @property
    def start_clearance(self) -> float:
        """Metres from the person at which no first step can end an episode."""
        return self.keep_out_radius + math.sqrt(2) * MAX_SPEED * self.step_duration

    def __post_init__(self) -> None:
        reach = MAX_SPEED * self.step_duration
        if self.max_altitude - self.min_altitude <= 2 * reach:
            raise InvalidConfig(
                f"environment.min_altitude, max_altitude: a workspace from {self.min_altitude} to {self.max_altitude} "
                f"m high has no room to start in, with steps of {reach} m"
            )
        if self.half_width - reach <= self.start_clearance:
            raise InvalidConfig(
                f"environment.keep_out_radius, half_width: a keep-out of {self.keep_out_radius} m leaves no room in "
                f"±{self.half_width} m to start in, with steps of {reach} m"
            )


class HoverConfig(EnvironmentConfig, frozen=True):
    """`vantage/Hover-v1`: certainty in metres, all of it estimated. Lengths in metres.

    The keys of `[environment]` mean the same here, apart from `uncertainty_scale` and `success_threshold`, which are
    version 0's.

    Attributes:
        error_scale: factor on the expected error, weighted over the upper body, R1 of the reward; 1 at most.
        wrist_radius: a hand to hand over to is certain below it: of the sphere that holds its wrist with probability
            0.9.
        body_radius: likewise for the upper body, the weighted mean of its joints.
        certain_pictures: in a row, that make an episode a success.
    """

    error_scale: Positive = 20.0
    wrist_radius: Length = 0.045
    body_radius: Length = 0.026
    certain_pictures: Count = 3
