"""`vantage/Hover-v0`: fly to where a person's pose is seen with certainty (thesis, section 4.3)."""

from typing import Any, SupportsIndex

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from agent.environment.arguments import require_no_rendering, require_split
from agent.environment.episode_seeds import drawn_seed, require_seed
from agent.environment.flight import Flight
from agent.environment.hover_task import HoverTask
from agent.environment.pending_flight import request_estimate
from agent.environment.reset_options import require_no_options
from agent.environment.sensor import Sensor
from agent.environment.spaces import ACTION_SIZE, action_space, require_actions
from agent.environment.stages import StageTimes
from agent.environment.versions import hover_task
from protocol.arrays import Float32Array
from protocol.environment_config import EnvironmentConfig
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
        self._task: HoverTask = hover_task(self.config)
        self.observation_space = self._task.observation_space()
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
        flight = self._task.take_off(episode_seed, self._sensor.sample(episode_seed, self._split))
        self.flight, times = self._observe(flight)
        return self._task.observation(self.flight), info_of(self._task, self.flight, times)

    def step(self, action: Float32Array) -> tuple[Float32Array, float, bool, bool, dict[str, Any]]:
        """Fly for one step and observe the person.

        Raises:
            InvalidInput: the action is not three finite numbers; the episode stays as it was.
            CallFailed: no worker answered; the episode stays as it was.
        """
        if self.flight is None or self.flight.over:
            raise ResetNeeded("the episode is over, or none was begun: call reset() first")
        moved = self._task.move(self.flight, require_actions(action, (ACTION_SIZE,)))
        observed, times = self._observe(moved)
        flight, reward = self._task.with_reward(observed)
        self.flight = flight
        info = info_of(self._task, flight, times)
        return self._task.observation(flight), reward, flight.terminated, flight.outcome == "truncated", info

    def _observe(self, flight: Flight) -> tuple[Flight, StageTimes]:
        return request_estimate(flight, self._sensor, self._task).finished()


def info_of(task: HoverTask, flight: Flight, times: StageTimes) -> dict[str, Any]:
    """A step's info beside the observation; nothing in it is shared with the episode's state.

    `outcome`, `uncertainty` (weighted: of version 0 from 0 to 10, of version 1 in metres), `quality` (18,), `position`
    (metres), `timings` (seconds by stage, of the picture if one was taken); of the episode so far its `seed`, `length`
    in steps and `total_reward`.
    """
    return {
        "outcome": flight.outcome,
        "uncertainty": task.uncertainty(flight),
        "quality": flight.quality.copy(),
        "position": np.array(flight.position),
        "timings": times,
        "seed": flight.seed,
        "length": flight.steps,
        "total_reward": flight.total_reward,
    }
