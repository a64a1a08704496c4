"""A directory of views that are observed: what it was told, and that it is never told anything else."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.errors import NoSuchRun
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.directory_lock import directory_lock
from orchestrator.run.run_directory import LOCK_PATIENCE
from protocol.artifact import whole_file
from protocol.config import EvaluationConfig, RenderConfig, RunConfig, SupervisionConfig, TimeoutsConfig
from protocol.config_file import load_resolved_config, require_recorded_files, with_content_alone
from protocol.errors import InvalidInput
from protocol.whole_record import read_whole


class Views(Protocol):
    """The set of views."""

    @property
    def words(self) -> str:
        """A description of the views, for messages."""
        ...


ViewsT = TypeVar("ViewsT", bound=Views)


class ViewsDirectory(Struct, Generic[ViewsT], frozen=True):
    """A directory that records a set of views and the configuration of the workers that observe them."""

    path: Path

    kind: ClassVar[str]
    """The name of the kind of directory, for messages."""

    views_type: ClassVar[type[Any]]

    came_later: ClassVar[tuple[str, ...]] = ()
    """Fields that older records of views lack; their values were the defaults."""

    @classmethod
    def open_for(cls, path: Path, config: RunConfig, views: ViewsT) -> Self:
        """Make the directory, or open the one that was begun with the same configuration and views.

        Raises:
            InvalidInput: it was begun with others, or another kind of directory is there.
            OtherArtifact: a file that its configuration names has another content now, or is gone.
        """
        directory = cls(path)
        if not directory.views_path.is_file():
            directory._begin(config, views)
        recorded = directory.config()
        require_recorded_files(recorded)
        for told, wanted, words in (
            (directory.views(), views, f"other views ({directory.views().words}, not {views.words})"),
            (what_counts(recorded), what_counts(config), "another configuration (its config.toml)"),
        ):
            if told != wanted:
                raise InvalidInput(
                    f"{path} was begun with {words}, which is never changed: "
                    "continue it as it is, or choose another directory with --out"
                )
        return directory

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open an existing directory.

        Raises:
            NoSuchRun: there is none at `path`.
        """
        directory = cls(path)
        if not directory.views_path.is_file():
            raise NoSuchRun(f"{path} is no {cls.kind} (it has no views.json)")
        return directory

    @property
    def config_path(self) -> Path:
        """The resolved configuration of its workers."""
        return self.path / "config.toml"

    @property
    def views_path(self) -> Path:
        """The record of the views."""
        return self.path / "views.json"

    def config(self) -> RunConfig:
        """The configuration of its workers.

        Raises:
            InvalidConfig: the file is damaged.
        """
        return load_resolved_config(self.config_path)

    def views(self) -> ViewsT:
        """The views that it was begun with.

        Raises:
            DamagedRecord: the file can't be read, or lacks a field.
        """
        return read_whole(self.views_path, self.views_type, may_lack=self.came_later)

    @contextmanager
    def lock(self) -> Generator[None]:
        """Be the only command that works on it.

        Raises:
            RunBusy: another command works on it.
        """
        with directory_lock(self.path, LOCK_PATIENCE, f"another command works on {self.path}"):
            yield

    def _begin(self, config: RunConfig, views: ViewsT) -> None:
        if self.path.exists() and any(one for one in self.path.iterdir() if one.name != self.config_path.name):
            raise InvalidInput(f"{self.path} is no {self.kind} and not empty; choose another directory with --out")
        with whole_file(self.config_path) as aside:
            aside.write_bytes(resolved_toml(config))
        # Last: a directory with this file has both.
        with whole_file(self.views_path) as aside:
            aside.write_bytes(msgspec.json.format(msgspec.json.encode(views), indent=2) + b"\n")


def what_counts(config: RunConfig) -> RunConfig:
    """The configuration without what replies don't depend on: the number of workers, timeouts, places of files."""
    files = with_content_alone(config)
    return replace(
        files,
        evaluation=EvaluationConfig(),
        render=replace(files.render, workers=RenderConfig().workers),
        perception=replace(files.perception, workers=1, prefetch=1),
        timeouts=TimeoutsConfig(),
        supervision=SupervisionConfig(),
    )
