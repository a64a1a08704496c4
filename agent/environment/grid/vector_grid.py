"""Several drones at once on the grid; a step takes microseconds, since every view was taken before."""

from typing import Any

import numpy as np
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from agent.environment.arguments import require_autoreset, require_drones, require_no_rendering, require_split
from agent.environment.episode_seeds import GivenSeed, drawn_seed, require_seeds
from agent.environment.flight import Flight
from agent.environment.grid.spaces import action_space, observation_space, require_moves
from agent.environment.grid.starts import episode_seeds
from agent.environment.grid.symmetries import walked_map
from agent.environment.grid.threshold import success_threshold, threshold_after
from agent.environment.grid.walks import GridStep, Walks, outcomes, take_step
from agent.environment.reset_options import reset_mask
from agent.environment.vector_hover import StepResult
from protocol.arrays import BoolArray, Float32Array
from protocol.grid.named_tables import open_table
from protocol.grid.table import GridTable
from protocol.grid_config import GridConfig
from protocol.scene import Split


class VectorGrid(VectorEnv[Float32Array, ArrayLike, NDArray[Any]]):
    """`num_envs` of `vantage/Grid-v0`; `step` may be split into `send` and `receive`, as `VectorHover`'s.

    A finished episode is followed by the next in the same step; its last observation and info are in
    `infos["final_obs"]` and `infos["final_info"]`. With autoreset disabled it stays where it is, with reward 0.
    """

    def __init__(
        self,
        table: GridTable | None = None,
        num_envs: int | None = None,
        config: GridConfig | None = None,
        split: Split = "train",
        curriculum: bool = False,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        render_mode: str | None = None,
    ) -> None:
        """Check the arguments.

        Args:
            table: the views; by default, the table that the configuration names.
            num_envs: drones; the configuration's, if none is given.
            curriculum: whether the threshold of success falls with the steps of all drones, as the configuration says.
            autoreset_mode: as `VectorHover`'s.
            render_mode: Gymnasium's; only None is offered. `Grid` draws one drone's walk.

        Raises:
            InvalidInput: another split, number of drones or autoreset mode, or a render mode.
            ArtifactDamaged, ArtifactMissing: there is no such table.
        """
        require_no_rendering(render_mode, "several drones at once render nothing; Grid-v0 alone draws its walk")
        require_split(split)
        mode = require_autoreset(autoreset_mode)
        self.config = config or GridConfig()
        self.num_envs = self.config.num_envs if num_envs is None else require_drones(num_envs)
        self.metadata = {"render_modes": [], "autoreset_mode": mode}
        self.single_observation_space = observation_space()
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        table = table or open_table(self.config.table)
        self.grid_map = walked_map(table, self.config, split)
        self.success_threshold = success_threshold(self.config, table)
        self._curriculum = curriculum
        self._follows = mode is AutoresetMode.SAME_STEP
        self._run_seed = 0
        self._begun = 0
        self._taken = 0
        self._walks: Walks | None = None
        self._over: BoolArray = np.zeros(self.num_envs, bool)
        self._under_way: StepResult | None = None

    flights: tuple[Flight, ...] = ()
    """None; the policies that are scripted for flights walk nowhere."""

    @property
    def walks(self) -> Walks:
        """Where the drones are.

        Raises:
            ResetNeeded: no episode was begun.
        """
        if self._walks is None:
            raise ResetNeeded("no episode was begun: call reset() first")
        return self._walks

    @property
    def is_begun(self) -> bool:
        """Whether there are episodes."""
        return self._walks is not None

    @property
    def threshold(self) -> float:
        """The weighted uncertainty below which an episode succeeds now."""
        if not self._curriculum:
            return self.success_threshold
        return threshold_after(self._taken, self.success_threshold, self.config)

    @property
    def observations(self) -> Float32Array:
        """(n, 20) the current observation of every drone."""
        return self.walks.observations(self.grid_map)

    def reset(
        self, *, seed: GivenSeed = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Begin an episode on every drone, or on some; see `VectorHover.reset`.

        Raises:
            InvalidInput: a seed is not a whole number of 0 or more, or one is missing; there is another option, or the
                mask is invalid. The episodes stay as they were.
            ResetNeeded: some drones are to begin anew before all have begun.
        """
        seeds, begins = require_seeds(seed, self.num_envs), reset_mask(options, self.num_envs)
        if self._walks is None and not begins.all():
            raise ResetNeeded("no episode was begun: call reset() for all drones first")
        self._under_way = None
        if isinstance(seeds, int) or self._walks is None:
            self._begin_run(seeds if isinstance(seeds, int) else None)
        drones = np.flatnonzero(begins)
        new = self._next_seeds(drones)
        if isinstance(seeds, list):
            new = np.array(
                [own if seeds[drone] is None else seeds[drone] for drone, own in zip(drones, new, strict=True)]
            )
        self._begin(drones, new)
        return self.observations, self._infos(begins)

    def send(self, actions: ArrayLike) -> None:
        """Move every drone for a step.

        Raises:
            InvalidInput: an action is not a whole number from 0 to 7; the episodes stay as they were.
        """
        if self._under_way is not None:
            raise AlreadyPendingCallError("a step is under way already: call receive() first", "send")
        self._under_way = self._stepped(self.walks, require_moves(actions, self.num_envs))

    def receive(self) -> StepResult:
        """The step that was sent: observations (n, 20), rewards, terminated, truncated, infos."""
        if self._under_way is None:
            raise NoAsyncCallError("no step is under way: call send() first", "receive")
        result, self._under_way = self._under_way, None
        return result

    def step(self, actions: ArrayLike) -> StepResult:
        """`send`, then `receive`."""
        self.send(actions)
        return self.receive()

    @property
    def is_under_way(self) -> bool:
        """Whether a step was sent and not yet received."""
        return self._under_way is not None

    def state(self) -> dict[str, Any]:
        """Everything the episodes' future depends on, between two steps: arrays and plain values, nested."""
        return {
            "run_seed": self._run_seed,
            "begun": self._begun,
            "taken": self._taken,
            "walks": self.walks.state(),
            "over": self._over,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state` of an environment of the same configuration and table."""
        self._run_seed, self._begun, self._taken = state["run_seed"], state["begun"], state["taken"]
        self._walks, self._over = Walks(**state["walks"]), state["over"]
        self._under_way = None

    def _begin_run(self, seed: int | None) -> None:
        """Count episodes and steps from 0."""
        super().reset(seed=seed)
        self._run_seed = drawn_seed(self.np_random) if seed is None else seed
        self._begun = self._taken = 0
        # Gymnasium does not seed the spaces: samples from them would differ from process to process.
        self.action_space.seed(drawn_seed(self.np_random))
        self.single_action_space.seed(drawn_seed(self.np_random))

    def _next_seeds(self, drones: NDArray[np.intp]) -> NDArray[np.int64]:
        """The seeds of the run's next episodes, one for each of these drones."""
        numbers = np.arange(self._begun, self._begun + len(drones), dtype=np.int64)
        self._begun += len(drones)
        return episode_seeds(self._run_seed, numbers)

    def _begin(self, drones: NDArray[np.intp], seeds: NDArray[np.int64]) -> None:
        new = Walks.begin(seeds, self.grid_map)
        self._walks = new if len(drones) == self.num_envs else self.walks.with_begun(drones, new)
        self._over = self._over.copy()
        self._over[drones] = False

    def _stepped(self, before: Walks, actions: NDArray[np.intp]) -> StepResult:
        step = take_step(
            before,
            actions,
            self.grid_map,
            threshold=self.threshold,
            reward=self.config.reward,
            episode_steps=self.config.episode_steps,
        )
        self._taken += self.num_envs
        if self._follows:
            return self._followed(step)
        return self._rested(before, step)

    def _followed(self, step: GridStep) -> StepResult:
        """The step, with the next episode begun where one ended."""
        self._walks = step.walks
        ended = np.flatnonzero(step.over)
        final: dict[str, Any] = {}
        if len(ended):
            final = self._final_infos(step)
            self._begin(ended, self._next_seeds(ended))
        return self.observations, step.rewards, step.terminated, step.truncated, self._infos() | final

    def _rested(self, before: Walks, step: GridStep) -> StepResult:
        """The step, with finished episodes left where they were."""
        rested, moved = np.flatnonzero(self._over), ~self._over
        self._walks = step.walks.with_begun(rested, before.of(rested))
        self._over = self._over | step.over
        return (
            self.observations,
            np.where(moved, step.rewards, 0.0),
            step.terminated & moved,
            step.truncated & moved,
            self._infos(),
        )

    def _final_infos(self, step: GridStep) -> dict[str, Any]:
        """What Gymnasium tells of the episodes that ended in a step."""
        over = step.over
        return {
            "final_obs": step.walks.observations(self.grid_map),
            "_final_obs": over,
            "final_info": self._infos_of(step.walks) | {"outcome": outcomes(step)},
            "_final_info": over,
        }

    def _infos(self, begins: BoolArray | None = None) -> dict[str, Any]:
        """Those of all drones, with a mask where only some began."""
        infos = self._infos_of(self.walks)
        masks = {} if begins is None or begins.all() else {f"_{name}": begins for name in infos}
        return {**infos, **masks, "timings": ()}

    def _infos_of(self, walks: Walks) -> dict[str, Any]:
        """(n,) each: weighted `uncertainty`; of the episode so far its `seed`, `length` and `total_reward`."""
        return {
            "uncertainty": walks.uncertainty(self.grid_map),
            "seed": walks.seeds,
            "length": walks.steps,
            "total_reward": walks.total_reward,
        }
