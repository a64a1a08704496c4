"""An experiment on disk: what it was told, its tables, and what was made of them."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.directory_lock import directory_lock
from orchestrator.errors import NoSuchRun
from orchestrator.experiments.views import ViewSet
from orchestrator.run_directory import LOCK_PATIENCE, resolved_toml
from protocol.artifact import whole_file
from protocol.config import RenderConfig, RunConfig, SupervisionConfig, TimeoutsConfig, load_config
from protocol.errors import InvalidInput


class ExperimentDirectory(Struct, frozen=True):
    """The files of one experiment."""

    path: Path

    @classmethod
    def open_for(cls, path: Path, config: RunConfig, views: ViewSet) -> "ExperimentDirectory":
        """Make an experiment, or take up the one that was begun with the same configuration and views.

        Raises:
            InvalidInput: it was begun with others, or something else is there.
        """
        directory = cls(path)
        if not directory.views_path.is_file():
            directory._begin(config, views)
        for told, wanted, words in (
            (directory.views(), views, f"other views ({_words(directory.views())}, not {_words(views)})"),
            (what_counts(directory.config()), what_counts(config), "another configuration (its config.toml)"),
        ):
            if told != wanted:
                raise InvalidInput(
                    f"{path} was begun with {words}, and an experiment is never changed: "
                    "go on with it as it is, or choose another directory with --out"
                )
        return directory

    @classmethod
    def open(cls, path: Path) -> "ExperimentDirectory":
        """Take up an experiment that is there.

        Raises:
            NoSuchRun: there is none.
        """
        directory = cls(path)
        if not directory.views_path.is_file():
            raise NoSuchRun(f"{path} is no experiment (it has no views.json)")
        return directory

    @property
    def config_path(self) -> Path:
        """The resolved configuration of its workers."""
        return self.path / "config.toml"

    @property
    def views_path(self) -> Path:
        """Which views it is made of."""
        return self.path / "views.json"

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

    def config(self) -> RunConfig:
        """What its workers were told.

        Raises:
            InvalidConfig: the file was damaged.
        """
        return load_config(self.config_path)

    def views(self) -> ViewSet:
        """The views that it was begun with.

        Raises:
            InvalidInput: the file was damaged.
        """
        try:
            return msgspec.json.decode(self.views_path.read_bytes(), type=ViewSet)
        except (OSError, msgspec.MsgspecError) as error:
            raise InvalidInput(f"{self.views_path} can't be read: {error}") from error

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

    @contextmanager
    def lock(self) -> Generator[None]:
        """Be the only one that works on it.

        Raises:
            RunBusy: another command does.
        """
        with directory_lock(self.path, LOCK_PATIENCE, f"another command works on {self.path}"):
            yield

    def _begin(self, config: RunConfig, views: ViewSet) -> None:
        if self.path.exists() and any(one for one in self.path.iterdir() if one.name != self.config_path.name):
            raise InvalidInput(f"{self.path} is no experiment and not empty; choose another directory with --out")
        with whole_file(self.config_path) as aside:
            aside.write_bytes(resolved_toml(config))
        # Last: a directory with it has all that an experiment begins with.
        with whole_file(self.views_path) as aside:
            aside.write_bytes(msgspec.json.format(msgspec.json.encode(views), indent=2) + b"\n")


def default_path(views: ViewSet) -> Path:
    """Where an experiment goes that was given no directory."""
    return Path("runs") / "experiments" / f"qoe-{views.split}-{views.seed}"


def what_counts(config: RunConfig) -> RunConfig:
    """What answers depend on: neither how many workers there are nor how long they are waited for."""
    return replace(
        config,
        render=replace(config.render, workers=RenderConfig().workers),
        perception=replace(config.perception, workers=1, prefetch=1),
        timeouts=TimeoutsConfig(),
        supervision=SupervisionConfig(),
    )


def _words(views: ViewSet) -> str:
    noises = " and ".join(views.depth_noises)
    each = f"{views.views_a_scene} a scene, {views.frames_a_part} a part"
    return f"{views.frames} frames of {views.split}, seed {views.seed}, {each}, depth noise {noises}"
