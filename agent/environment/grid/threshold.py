"""The weighted uncertainty below which an episode succeeds; in a training it falls (thesis, section 4.4)."""

from protocol.grid.table import GridTable
from protocol.grid.threshold import threshold_by_rule, weighted_uncertainties
from protocol.grid_config import GridConfig


def success_threshold(config: GridConfig, table: GridTable) -> float:
    """The configured threshold, or else the table's own."""
    if config.success_threshold is not None:
        return config.success_threshold
    return threshold_by_rule(weighted_uncertainties(table)[table.of_split("train")])


def threshold_after(steps: int, last: float, config: GridConfig) -> float:
    """The threshold after so many environment steps of a training: it falls from `curriculum_range` above `last`."""
    fallen = config.curriculum_step * (steps // config.curriculum_every)
    return last + max(config.curriculum_range - fallen, 0.0)
