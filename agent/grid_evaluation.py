"""Evaluation on the grid: the trained policy and the baselines, on environments that no training walks on.

Every start in every test environment is walked, so nothing but the policy is drawn.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from msgspec import Struct
from numpy.typing import NDArray

from agent.checkpointing.weights import FILE_NAME, load_weights
from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.threshold import success_threshold
from agent.environment.grid.walks import Walks
from agent.grid_episodes import GridEpisodes, every_start, walk_episodes
from agent.grid_scores import policy_score, score
from agent.learning.grid_policies import GRID_BASELINES, GridPolicy
from agent.learning.recurrent.policy import RecurrentPolicy
from protocol.artifact import sha256
from protocol.config import RunConfig
from protocol.errors import InvalidInput
from protocol.grid.named_tables import open_table, table_path
from protocol.grid.paths import shortest_paths
from protocol.grid.records import GridEvaluation, GridThreshold
from protocol.grid.table import CELLS, GridTable
from protocol.grid.threshold import THESIS_THRESHOLD, ceiling, threshold_by_rule, weighted_uncertainties
from protocol.records import Evaluation
from protocol.scene import Split

MakePolicy = Callable[[GridMap, float], GridPolicy]
"""A policy for a map and a threshold."""


class EvaluatedOnGrid(Struct, frozen=True, eq=False):
    """An evaluation: its table, its details, and the first policy's walks at the run's own threshold."""

    evaluation: Evaluation
    details: GridEvaluation
    walks: GridEpisodes


class RunOnGrid(Struct, frozen=True, eq=False, kw_only=True):
    """What the evaluation of a run on the grid needs.

    Attributes:
        thresholds: the run's own first.
    """

    config: RunConfig
    table: GridTable
    grid_map: GridMap
    policies: Mapping[str, MakePolicy]
    thresholds: tuple[float, ...]
    split: Split = "test"

    @property
    def steps(self) -> int:
        """The most steps that all episodes take."""
        episodes = len(self.grid_map.places) * (CELLS - 1)
        return len(self.thresholds) * len(self.policies) * episodes * self.config.grid.episode_steps

    def walk(self, on_step: Callable[[int], None]) -> EvaluatedOnGrid:
        """Walk every start with every policy; `on_step` gets the steps of each round, and may raise to stop."""
        evaluated = [self._at(threshold, on_step) for threshold in self.thresholds]
        thresholds = tuple(scored for scored, _ in evaluated)
        own, walks = evaluated[0]
        return EvaluatedOnGrid(
            Evaluation(
                first_seed=0,
                success_threshold=own.threshold,
                scores=tuple(policy_score(details) for details in own.scores),
            ),
            GridEvaluation(
                split=self.split,
                table=self.config.grid.table,
                table_checksum=sha256(table_path(self.config.grid.table)),
                environments=len(self.grid_map.places),
                thresholds=thresholds,
                weights=None,
                by="",
            ),
            walks,
        )

    def _at(self, threshold: float, on_step: Callable[[int], None]) -> tuple[GridThreshold, GridEpisodes]:
        """The scores of all policies at a threshold, and the episodes of the first."""
        walked = {
            name: self._walked(make(self.grid_map, threshold), threshold, on_step)
            for name, make in self.policies.items()
        }
        weighted, begun = self.grid_map.uncertainty.astype(np.float64), every_start(self.grid_map)
        shortest = shortest_paths(weighted < threshold)[begun.place, begun.cell]
        reachable = shortest[np.isfinite(shortest)]
        scored = GridThreshold(
            threshold=threshold,
            ceiling=ceiling(weighted, threshold),
            optimum=float(reachable.mean()) if len(reachable) else None,
            scores=tuple(score(name, episodes, self.grid_map, threshold) for name, episodes in walked.items()),
        )
        return scored, next(iter(walked.values()))

    def _walked(self, policy: GridPolicy, threshold: float, on_step: Callable[[int], None]) -> GridEpisodes:
        grid = self.config.grid
        return walk_episodes(
            policy,
            every_start(self.grid_map),
            self.grid_map,
            threshold=threshold,
            reward=grid.reward,
            episode_steps=grid.episode_steps,
            on_step=on_step,
        )


class TrainedWalk:
    """A learned policy's moves, drawn from it: its most probable ones alone may go to and fro without end.

    Args:
        seed: of the draws.
    """

    def __init__(self, policy: RecurrentPolicy, grid_map: GridMap, seed: int) -> None:
        self._policy = policy
        self._map = grid_map
        self._seed = seed
        self._generator = torch.Generator()

    def begin(self, walks: Walks) -> None:
        """Forget all episodes, and draw anew."""
        self._policy.start(len(walks.cell))
        self._generator.manual_seed(self._seed)

    def act(self, walks: Walks) -> NDArray[np.intp]:
        """(n,)."""
        seen = walks.observations(self._map)
        return self._policy.act(seen, explore=True, generator=self._generator).astype(np.intp)

    def keep(self, drones: NDArray[np.intp]) -> None:
        """Remember these alone."""
        self._policy.keep(drones)


def open_run_on_grid(run: Path, config: RunConfig, names: Sequence[str], split: Split = "test") -> RunOnGrid:
    """The evaluation of a run's policies.

    Raises:
        InvalidInput: no policy has that name.
        ArtifactMissing, ArtifactDamaged: there are no weights or no table, or they don't fit the configuration.
    """
    table = open_table(config.grid.table)
    return RunOnGrid(
        config=config,
        table=table,
        grid_map=GridMap.of_table(table, split, config.grid.observation),
        policies={name: _policy_maker(run, config, name) for name in names},
        thresholds=thresholds_of(config, table),
        split=split,
    )


def thresholds_of(config: RunConfig, table: GridTable) -> tuple[float, ...]:
    """The run's own threshold, the one by rule, and the thesis's where the table has the thesis's quality."""
    by_rule = threshold_by_rule(weighted_uncertainties(table)[table.of_split("train")])
    thesis = (THESIS_THRESHOLD,) if table.recipe.certainty == "quality" else ()
    return tuple(dict.fromkeys((success_threshold(config.grid, table), by_rule, *thesis)))


def _policy_maker(run: Path, config: RunConfig, name: str) -> MakePolicy:
    if name in GRID_BASELINES:
        return GRID_BASELINES[name]
    if name != config.learner.algorithm:
        known = ", ".join((config.learner.algorithm, *GRID_BASELINES))
        raise InvalidInput(f"there is no policy '{name}' in this run; there are {known}")
    weights, _ = load_weights(run / FILE_NAME)
    policy = RecurrentPolicy.of_weights(weights, config.learner.recurrent_ppo)
    return lambda grid_map, _threshold: TrainedWalk(policy, grid_map, config.evaluation.first_seed)
