"""Evaluation on the grid: the trained policy and the baselines, on environments that no training walks on."""

from collections.abc import Callable, Mapping

import numpy as np
from msgspec import Struct

from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.starts import starts
from agent.environment.grid.walks import Walks
from agent.grid_episodes import GridEpisodes, every_start, walk_episodes
from agent.grid_scores import score
from agent.intervals import mean_interval, rate_interval
from agent.learning.grid_policies import GRID_BASELINES, GridPolicy
from protocol.config import RunConfig
from protocol.grid_paths import shortest_paths
from protocol.grid_records import GridThreshold
from protocol.grid_threshold import ceiling
from protocol.records import Evaluation, PolicyScore


class GridEvaluator(Struct, frozen=True, eq=False):
    """Walks the episodes of an evaluation.

    Attributes:
        on_step: called with the number of steps of each round; may raise to stop.
    """

    config: RunConfig
    grid_map: GridMap
    on_step: Callable[[int], None] = lambda _steps: None

    def walked(self, policy: GridPolicy, begun: Walks, threshold: float) -> GridEpisodes:
        """The finished episodes of a policy."""
        grid = self.config.grid
        return walk_episodes(
            policy,
            begun,
            self.grid_map,
            threshold=threshold,
            reward=grid.reward,
            episode_steps=grid.episode_steps,
            on_step=self.on_step,
        )

    def sampled(self, policies: Mapping[str, GridPolicy], episodes: int, threshold: float) -> Evaluation:
        """The scores of policies over the episodes of the configured seeds."""
        first = self.config.evaluation.first_seed
        place, cell = starts(np.arange(first, first + episodes), len(self.grid_map.places))
        begun = Walks.begin_at(place, cell)
        scores = tuple(
            self._policy_score(name, self.walked(policy, begun, threshold)) for name, policy in policies.items()
        )
        return Evaluation(first_seed=first, success_threshold=threshold, scores=scores)

    def exhaustive(self, policies: Mapping[str, GridPolicy], threshold: float) -> GridThreshold:
        """The scores of policies over every start in every environment."""
        begun, weighted = every_start(self.grid_map), self.grid_map.uncertainty.astype(np.float64)
        scores = [
            score(name, self.walked(policy, begun, threshold), self.grid_map, threshold)
            for name, policy in policies.items()
        ]
        shortest = shortest_paths(weighted < threshold)[begun.place, begun.cell]
        reachable = shortest[np.isfinite(shortest)]
        return GridThreshold(
            threshold=threshold,
            ceiling=ceiling(weighted, threshold),
            optimum=float(reachable.mean()) if len(reachable) else None,
            scores=tuple(scores),
        )

    def _policy_score(self, name: str, episodes: GridEpisodes) -> PolicyScore:
        count = len(episodes.length)
        ends = self.grid_map.uncertainty[episodes.place, episodes.end]
        return PolicyScore(
            policy=name,
            episodes=count,
            total_reward=mean_interval(episodes.total_reward.tolist()),
            uncertainty=mean_interval(ends.tolist()),
            success=rate_interval(int(episodes.succeeded.sum()), count),
            crash=rate_interval(int(episodes.crashed.sum()), count),
            length=mean_interval(episodes.length.tolist()),
        )


def baselines(names: tuple[str, ...], grid_map: GridMap, threshold: float) -> dict[str, GridPolicy]:
    """The named baselines, for a map and a threshold."""
    return {name: GRID_BASELINES[name](grid_map, threshold) for name in names}
