"""An experiment on disk: its configuration, its tables, and the figures of these."""

from pathlib import Path
from typing import ClassVar

import msgspec
from msgspec import Struct

from orchestrator.experiments.views import ViewSet
from orchestrator.experiments.views_directory import ViewsDirectory
from protocol.artifact import whole_file
from protocol.errors import InvalidInput


class ExperimentDirectory(ViewsDirectory[ViewSet], frozen=True):
    """The files of one experiment."""

    kind: ClassVar[str] = "experiment"
    views_type: ClassVar[type[ViewSet]] = ViewSet
    came_later: ClassVar[tuple[str, ...]] = ("poses",)

    @property
    def table_path(self) -> Path:
        """A row for each frame and joint."""
        return self.path / "qoe.parquet"

    @property
    def flights_path(self) -> Path:
        """A row for each joint of each step of the flights."""
        return self.path / "flights.parquet"

    @property
    def flight_set_path(self) -> Path:
        """The set of flights."""
        return self.path / "flights.json"

    @property
    def figures_path(self) -> Path:
        """The figures, as JSON."""
        return self.path / "figures.json"

    @property
    def page_path(self) -> Path:
        """The figures, as Markdown."""
        return self.path / "figures.md"

    @property
    def plots(self) -> Path:
        """Pictures of the figures."""
        return self.path / "plots"

    def require_same(self, path: Path, told: Struct) -> None:
        """Record the settings that a table is made with, unless they are recorded already.

        Raises:
            InvalidInput: other settings are recorded.
        """
        written = msgspec.json.format(msgspec.json.encode(told), indent=2) + b"\n"
        if not path.is_file():
            with whole_file(path) as aside:
                aside.write_bytes(written)
        elif (before := path.read_bytes()) != written:
            raise InvalidInput(f"{path} says {before.decode().strip()}, and not {written.decode().strip()}")


def default_path(views: ViewSet) -> Path:
    """The default directory of an experiment."""
    families = "-families" if views.poses == "families" else ""
    return Path("runs") / "experiments" / f"qoe-{views.split}-{views.seed}{families}"
