"""`vantage/Hover-v0`: fly to where a person's pose is seen with certainty (thesis, section 4.3)."""

from typing import Any, SupportsIndex

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from agent.environment.arguments import require_no_rendering, require_split
from agent.environment.episode_seeds import drawn_seed, require_seed
from agent.environment.flight import Flight, camera_of, move, take_off, with_estimate, with_reward
from agent.environment.reset_options import require_no_options
from agent.environment.sensor import Sensor
from agent.environment.spaces import ACTION_SIZE, action_space, observation_of, observation_space, require_actions
from agent.environment.stages import StageTimes, times_of
from protocol.arrays import Float32Array
from protocol.config import EnvironmentConfig
from protocol.scene import Split


class Hover(gymnasium.Env[Float32Array, Float32Array]):
    """One drone and one person; the camera always faces the person.

    Observation (111,): 54 filtered joint coordinates, 54 posterior variances, the drone's position, in m and m².
    Action (3,): velocity in the world frame, in [-1, 1] m/s, flown for `step_duration`.
    An episode is a function of its seed: `reset(seed=s)` always gives the same scene, start and first observation.

    >>> from agent.environment.hover import Hover
    >>> from agent.environment.sensor import RemoteSensor
    >>> from protocol import Pool
    >>> from protocol.messages import Role
    >>> with (
    ...     Pool(["ipc://render-0"], role=Role.AGENT, serves=Role.RENDER) as renderers,
    ...     Pool(["ipc://perception-0"], role=Role.AGENT, serves=Role.PERCEPTION) as perceivers,
    ... ):
    ...     hover = Hover(RemoteSensor(renderers, perceivers))
    ...     observation, info = hover.reset(seed=7)
    ...     observation, reward, terminated, truncated, info = hover.step(hover.action_space.sample())
    >>> observation.shape, info["length"]
    ((111,), 1)
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        sensor: Sensor,
        config: EnvironmentConfig | None = None,
        split: Split = "train",
        render_mode: str | None = None,
    ) -> None:
        """Check the arguments.

        Args:
            render_mode: Gymnasium's; only None is offered.

        Raises:
            InvalidInput: another split, or a render mode.
        """
        require_no_rendering(render_mode)
        require_split(split)
        self.config = config or EnvironmentConfig()
        self.observation_space = observation_space()
        self.action_space = action_space()
        self._sensor = sensor
        self._split: Split = split
        self.flight: Flight | None = None

    def reset(
        self, *, seed: SupportsIndex | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Begin the episode of `seed`, or of one drawn from the last seed that was given.

        Raises:
            InvalidInput: the seed is not a whole number of 0 or more, or there are options.
            CallFailed: no worker answered.
        """
        require_no_options(options)
        given = None if seed is None else require_seed(seed)
        super().reset(seed=given)
        episode_seed = drawn_seed(self.np_random) if given is None else given
        flight = take_off(self.config, episode_seed, self._sensor.sample(episode_seed, self._split))
        self.flight, times = self._observe(flight)
        return observation_of(self.flight), info_of(self.flight, times)

    def step(self, action: Float32Array) -> tuple[Float32Array, float, bool, bool, dict[str, Any]]:
        """Fly for one step and observe the person.

        Raises:
            InvalidInput: the action is not three finite numbers; the episode stays as it was.
            CallFailed: no worker answered; the episode stays as it was.
        """
        if self.flight is None or self.flight.over:
            raise ResetNeeded("the episode is over, or none was begun: call reset() first")
        flight = move(self.config, self.flight, require_actions(action, (ACTION_SIZE,)))
        flight, times = (flight, StageTimes({})) if flight.ended_badly else self._observe(flight)
        flight, reward = with_reward(self.config, flight)
        self.flight = flight
        return observation_of(flight), reward, flight.ended_badly, flight.outcome == "truncated", info_of(flight, times)

    def _observe(self, flight: Flight) -> tuple[Flight, StageTimes]:
        estimate = self._sensor.observe(flight.scene, camera_of(self.config, flight), flight.filter)
        return with_estimate(flight, estimate.result()), times_of(estimate)


def info_of(flight: Flight, times: StageTimes) -> dict[str, Any]:
    """A step's info beside the observation; nothing in it is shared with the episode's state.

    `outcome`, `uncertainty` (weighted, 0 to 10), `quality` (18,), `position` (metres), `timings` (seconds by stage, of
    the picture if one was taken); of the episode so far its `seed`, `length` in steps and `total_reward`.
    """
    return {
        "outcome": flight.outcome,
        "uncertainty": flight.uncertainty,
        "quality": flight.quality.copy(),
        "position": np.array(flight.position),
        "timings": times,
        "seed": flight.seed,
        "length": flight.steps,
        "total_reward": flight.total_reward,
    }
