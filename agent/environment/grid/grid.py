"""`vantage/Grid-v0`: walk to where a person's pose is seen with certainty (thesis, sections 4.3.3 to 4.5)."""

from typing import Any, SupportsIndex

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from agent.environment.arguments import require_split
from agent.environment.episode_seeds import drawn_seed, require_seed
from agent.environment.grid.drawing import Scenery, draw, drawn_as_text
from agent.environment.grid.spaces import action_space, observation_space, require_moves
from agent.environment.grid.symmetries import walked_map
from agent.environment.grid.threshold import success_threshold
from agent.environment.grid.walks import GridStep, Walks, outcomes, take_step
from agent.environment.reset_options import require_no_options
from protocol.arrays import Float32Array
from protocol.errors import InvalidInput
from protocol.grid.named_tables import open_table
from protocol.grid.table import GridTable
from protocol.grid_config import GridConfig
from protocol.scene import Split


class Grid(gymnasium.Env[Float32Array, np.int64]):
    """One drone on a grid of 19×19 cells of one metre around a person; the camera always faces the person.

    Observation (20,): x and y in metres from the person, and the certainty of each joint, 0 to 1.
    Action: one of the eight neighbouring cells; see `MOVES`.
    An episode is a function of its seed: environment and start follow from it.

    >>> import gymnasium
    >>> import agent
    >>> grid = gymnasium.make("vantage/Grid-v0")
    >>> observation, info = grid.reset(seed=7)
    >>> observation, reward, terminated, truncated, info = grid.step(grid.action_space.sample())
    >>> observation.shape, info["length"]
    ((20,), 1)
    """

    metadata = {"render_modes": ["rgb_array", "ansi"], "render_fps": 4}

    def __init__(
        self,
        table: GridTable | str | None = None,
        config: GridConfig | None = None,
        split: Split = "train",
        render_mode: str | None = None,
    ) -> None:
        """Check the arguments.

        Args:
            table: the views, or the name or path of a table; by default, the one that the configuration names.
            render_mode: "rgb_array" for a picture of the map from above, "ansi" for text.

        Raises:
            InvalidInput: another split or render mode.
            ArtifactDamaged, ArtifactMissing: there is no such table.
        """
        require_split(split)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InvalidInput(f"render_mode {render_mode!r}: Grid-v0 has {self.metadata['render_modes']}")
        self.config = config or GridConfig()
        self.render_mode = render_mode
        self.observation_space = observation_space()
        self.action_space = action_space()
        views = table if isinstance(table, GridTable) else open_table(table or self.config.table)
        self.grid_map = walked_map(views, self.config, split)
        self.success_threshold = success_threshold(self.config, views)
        self._walk: Walks | None = None
        self._step: GridStep | None = None
        self._path: list[int] = []

    def reset(
        self, *, seed: SupportsIndex | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Begin the episode of `seed`, or of one drawn from the last seed that was given.

        Raises:
            InvalidInput: the seed is not a whole number of 0 or more, or there are options.
        """
        require_no_options(options)
        given = None if seed is None else require_seed(seed)
        super().reset(seed=given)
        episode_seed = drawn_seed(self.np_random) if given is None else given
        walk = Walks.begin(np.array([episode_seed]), self.grid_map)
        self._walk, self._step, self._path = walk, None, [int(walk.cell[0])]
        return walk.observations(self.grid_map)[0], self._info(walk)

    def step(self, action: np.int64) -> tuple[Float32Array, float, bool, bool, dict[str, Any]]:
        """Move to a neighbouring cell, and see the person from there.

        Raises:
            InvalidInput: the action is not a whole number from 0 to 7; the episode stays as it was.
        """
        if self._walk is None or (self._step is not None and self._step.over[0]):
            raise ResetNeeded("the episode is over, or none was begun: call reset() first")
        step = self._step = take_step(
            self._walk,
            require_moves(np.reshape(action, 1), 1),
            self.grid_map,
            threshold=self.success_threshold,
            reward=self.config.reward,
            episode_steps=self.config.episode_steps,
        )
        self._walk = step.walks
        self._path.append(int(step.walks.cell[0]))
        observation = step.walks.observations(self.grid_map)[0]
        info = self._info(step.walks) | {"outcome": outcomes(step)[0]}
        return observation, float(step.rewards[0]), bool(step.terminated[0]), bool(step.truncated[0]), info

    def render(self) -> NDArray[np.uint8] | str | None:  # type: ignore[override]
        """The walk so far on the map of the weighted uncertainty: a picture (h, w, 3), or text.

        Raises:
            ResetNeeded: no episode was begun.
        """
        if self.render_mode is None:
            gymnasium.logger.warn("render() needs a render_mode, such as gymnasium.make(..., render_mode='rgb_array')")
            return None
        if self._walk is None:
            raise ResetNeeded("no episode was begun: call reset() first")
        number = int(self._walk.place[0])
        place, uncertainty = self.grid_map.places[number], self.grid_map.uncertainty[number]
        scenery = Scenery(uncertainty=uncertainty, threshold=self.success_threshold, yaw=place.yaw)
        return draw(scenery, self._path) if self.render_mode == "rgb_array" else drawn_as_text(scenery, self._path)

    def _info(self, walk: Walks) -> dict[str, Any]:
        """Weighted `uncertainty`; of the episode so far its `seed`, `length` in steps and `total_reward`."""
        return {
            "uncertainty": float(walk.uncertainty(self.grid_map)[0]),
            "seed": int(walk.seeds[0]),
            "length": int(walk.steps[0]),
            "total_reward": float(walk.total_reward[0]),
        }
