"""The experiment on disk: its settings, its table, and what was learned from it."""

from pathlib import Path
from typing import ClassVar

from orchestrator.experiments.next_view.views import ArrayViews
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.views_directory import ViewsDirectory
from protocol.config import Profile


class NextViewDirectory(ViewsDirectory[ArrayViews], frozen=True):
    """The files of one experiment on the next view."""

    kind: ClassVar[str] = "experiment on the next view"
    views_type: ClassVar[type[ArrayViews]] = ArrayViews

    @property
    def table_path(self) -> Path:
        """A row for each view."""
        return self.path / "next-view.parquet"

    @property
    def choices_path(self) -> Path:
        """A row for each scene, way of choosing and seed."""
        return self.path / "choices.parquet"

    @property
    def scores_path(self) -> Path:
        """The scores of every choice, as JSON."""
        return self.path / "scores.json"

    @property
    def page_path(self) -> Path:
        """The scores, as Markdown."""
        return self.path / "scores.md"

    @property
    def plots(self) -> Path:
        """Pictures of the scores."""
        return self.path / "plots"

    def parts(self) -> Parts:
        """The parts of the table."""
        return Parts(self.table_path, len(self.views().parts))


def default_path(profile: Profile) -> Path:
    """The default directory of an experiment."""
    return Path("runs") / "experiments" / f"next-view-{profile}"
