"""An experiment on disk: what it was told, its tables, and what was made of them."""

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
        """The same of each step of the flights."""
        return self.path / "flights.parquet"

    @property
    def flight_set_path(self) -> Path:
        """Which flights were flown for it."""
        return self.path / "flights.json"

    @property
    def figures_path(self) -> Path:
        """What the tables come to, for programs."""
        return self.path / "figures.json"

    @property
    def page_path(self) -> Path:
        """The same for people, as Markdown."""
        return self.path / "figures.md"

    @property
    def plots(self) -> Path:
        """Pictures of the figures."""
        return self.path / "plots"

    def require_same(self, path: Path, told: Struct) -> None:
        """Note what something was made by, where that is not noted yet.

        Raises:
            InvalidInput: it was made by something else.
        """
        written = msgspec.json.format(msgspec.json.encode(told), indent=2) + b"\n"
        if not path.is_file():
            with whole_file(path) as aside:
                aside.write_bytes(written)
        elif (before := path.read_bytes()) != written:
            raise InvalidInput(f"{path} says {before.decode().strip()}, and not {written.decode().strip()}")


def default_path(views: ViewSet) -> Path:
    """Where an experiment goes that was given no directory."""
    families = "-families" if views.poses == "families" else ""
    return Path("runs") / "experiments" / f"qoe-{views.split}-{views.seed}{families}"
