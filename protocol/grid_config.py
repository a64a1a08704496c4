"""The configuration of `vantage/Grid-v0`."""

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from protocol.config_bounds import Count, Drones, NotNegative, Positive
from protocol.config_section import Section
from protocol.named_files import NamedFile

GridReward: TypeAlias = Literal["binary", "path_length", "quality"]
GridObservation: TypeAlias = Literal["quality", "position"]

GRID_TABLE = NamedFile("the grid's table", words="thesis|vantage")
"""A single word is a table that ships."""


class GridConfig(Section, frozen=True):
    """`vantage/Grid-v0`: cells of one metre around a person, and a view from each (thesis, sections 4.3.3 to 4.5).

    Attributes:
        table: the views: a table that ships (`thesis`, `vantage`), or a file that `orchestrator experiment grid build`
            made.
        num_envs: number of drones, each with its own episodes.
        episode_steps: after which an episode is truncated.
        reward: the thesis's three: +1 and -1 at success and crash (`binary`); as well -0.1 for each other step
            (`path_length`); or +10 and -10, and for each other step minus a fortieth of the weighted uncertainty
            (`quality`).
        observation: position and the quality of each joint, or with `position` zeros in place of the quality.
        symmetries: whether an environment to train on is also turned by quarter turns, and each of these mirrored.
        success_threshold: weighted uncertainty (0 to 10) below which an episode succeeds; left out, it is the table's:
            the lowest multiple of 0.05 at which 95% of its train environments have a cell that succeeds.
        curriculum_range: how far above that the threshold begins in a training.
        curriculum_step, curriculum_every: it falls by the one after so many environment steps.
    """

    table: Annotated[str, GRID_TABLE] = "thesis"
    num_envs: Drones = 128
    episode_steps: Count = 100
    reward: GridReward = "quality"
    observation: GridObservation = "quality"
    symmetries: bool = True
    success_threshold: Annotated[float, Meta(gt=0, le=10)] | None = None
    curriculum_range: NotNegative = 0.5
    curriculum_step: Positive = 0.05
    curriculum_every: Count = 60_000
