"""What a grid table holds, in a few numbers."""

from pathlib import Path

from msgspec import Struct

from protocol.grid.table import Certainty, read_table
from protocol.grid.threshold import THESIS_THRESHOLD, ceiling, threshold_by_rule, weighted_uncertainties
from protocol.scene import Split

SPLITS: tuple[Split, ...] = ("train", "test")


class SplitSummary(Struct, frozen=True, kw_only=True):
    """The environments of one split.

    Attributes:
        ceiling: share of environments with a cell that succeeds, at the threshold by rule.
        ceiling_at_thesis: likewise, at the thesis's threshold.
    """

    split: Split
    environments: int
    ceiling: float
    ceiling_at_thesis: float


class GridSummary(Struct, frozen=True, kw_only=True):
    """A table.

    Attributes:
        threshold: by rule, of the train environments.
    """

    table: str
    bytes: int
    certainty: Certainty
    threshold: float
    splits: tuple[SplitSummary, ...]

    @property
    def words(self) -> str:
        """The summary for people."""
        first = f"{self.table}: {self.bytes / 1e6:.2f} MB; threshold {self.threshold:.2f} by rule"
        return "\n".join([first, *map(_words, self.splits)])


def summary_of(path: Path) -> GridSummary:
    """The summary of a table's file.

    Raises:
        ArtifactDamaged: as `read_table`.
        InvalidInput: as `threshold_by_rule`.
    """
    table = read_table(path)
    weighted = weighted_uncertainties(table)
    threshold = threshold_by_rule(weighted[table.of_split("train")])

    def of_split(split: Split) -> SplitSummary:
        own = weighted[table.of_split(split)]
        return SplitSummary(
            split=split,
            environments=len(own),
            ceiling=ceiling(own, threshold),
            ceiling_at_thesis=ceiling(own, THESIS_THRESHOLD),
        )

    return GridSummary(
        table=str(path),
        bytes=path.stat().st_size,
        certainty=table.recipe.certainty,
        threshold=threshold,
        splits=tuple(map(of_split, SPLITS)),
    )


def _words(one: SplitSummary) -> str:
    return (
        f"{one.split}: {one.environments} environments, {one.ceiling:.1%} with a cell that succeeds at this threshold, "
        f"{one.ceiling_at_thesis:.1%} at the thesis's {THESIS_THRESHOLD:g}"
    )
