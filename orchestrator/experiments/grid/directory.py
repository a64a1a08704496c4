"""A grid table on disk: its settings, all views of its environments, and the file that ships."""

from pathlib import Path
from typing import ClassVar

from orchestrator.experiments.grid.views import GridViews
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.views_directory import ViewsDirectory
from protocol.config import Profile


class GridDirectory(ViewsDirectory[GridViews], frozen=True):
    """The files of one grid table."""

    kind: ClassVar[str] = "grid table"
    views_type: ClassVar[type[GridViews]] = GridViews

    @property
    def all_views_path(self) -> Path:
        """A row for each cell of each environment."""
        return self.path / "views.parquet"

    @property
    def table_path(self) -> Path:
        """The table that the agent reads, with a byte for each number."""
        return self.path / "grid.msgpack"

    def parts(self) -> Parts:
        """The parts of all views, one for each environment."""
        return Parts(self.all_views_path, self.views().count)


def default_path(profile: Profile) -> Path:
    """The default directory of a grid table."""
    return Path("runs") / "experiments" / f"grid-{profile}"
