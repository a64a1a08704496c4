"""A fit on disk: its views, their table, and the lifter."""

from pathlib import Path
from typing import ClassVar

from orchestrator.experiments.parts import Parts
from orchestrator.experiments.views_directory import ViewsDirectory
from orchestrator.lifter.views import FitViews

DEFAULT_PATH = Path("runs") / "lifter"


class FitDirectory(ViewsDirectory[FitViews], frozen=True):
    """The files of one fit."""

    kind: ClassVar[str] = "fit of a lifter"
    views_type: ClassVar[type[FitViews]] = FitViews

    @property
    def table_path(self) -> Path:
        """A row for each view."""
        return self.path / "views.parquet"

    @property
    def lifter_path(self) -> Path:
        """The fitted lifter."""
        return self.path / "lifter.msgpack"

    def parts(self) -> Parts:
        """The parts of the table."""
        views = self.views()
        return Parts(self.table_path, -(-views.frames // views.frames_a_part))
