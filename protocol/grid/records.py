"""The record of an evaluation on the grid: `grid.json` in a run directory, written by the agent."""

from typing import Literal, TypeAlias

from msgspec import Struct

from protocol.records import Interval
from protocol.scene import Split

FailureMode: TypeAlias = Literal["crash", "righteous", "oscillating", "circling", "wandering"]
"""How an episode fails. *Righteous* is the thesis's word (section 4.6.2): no cell of the environment succeeds."""


class GridScore(Struct, frozen=True, kw_only=True):
    """How one policy walked every episode of a split at a threshold.

    Intervals are over environments: the episodes of one environment are not independent of each other.

    Attributes:
        success: share of all episodes.
        success_of_solvable: share of those in environments with a cell that succeeds.
        length: steps of all episodes, and their standard deviation.
        success_length: steps of the episodes that succeeded; None without one.
        uncertainty: weighted, where the episodes ended.
        ratio: `success_length` over the mean of the shortest paths of the same episodes; None likewise.
        failures: number of the episodes that did not succeed, by how.
    """

    policy: str
    threshold: float
    episodes: int
    success: Interval
    success_of_solvable: Interval
    crash: Interval
    length: Interval
    length_deviation: float
    success_length: Interval | None
    ratio: float | None
    total_reward: Interval
    uncertainty: Interval
    failures: dict[FailureMode, int]


class GridThreshold(Struct, frozen=True, kw_only=True):
    """A threshold of success, and what it allows.

    Attributes:
        ceiling: share of environments with a cell that succeeds; no policy's success is higher.
        optimum: mean of the shortest paths to such a cell, over all starts of these environments.
    """

    threshold: float
    ceiling: float
    optimum: float | None
    scores: tuple[GridScore, ...]


class GridEvaluation(Struct, frozen=True, kw_only=True):
    """The evaluation of a run's policy and of the baselines, over every start in every environment of a split.

    Attributes:
        table: the table's name or path, and the sha256 of its file.
        weights: sha256 of the run's weights.
        by: the incarnation of the process that walked it.
    """

    split: Split
    table: str
    table_checksum: str
    environments: int
    thresholds: tuple[GridThreshold, ...]
    weights: str | None
    by: str
