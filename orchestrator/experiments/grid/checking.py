"""Whether environments that are built again by a table's recipe have the bytes of the table."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.experiments.grid.observed import ObservedEnvironment
from orchestrator.experiments.grid.storing import of_names
from orchestrator.experiments.grid.views import GridViews
from protocol.config import PerceptionConfig, RunConfig
from protocol.config_file import recorded_config
from protocol.errors import InvalidInput
from protocol.grid.table import GridPlace, GridRecipe, StoredGridTable, StoredPlace, stored_numbers, stored_place
from protocol.named_files import is_checksum, path_settings
from protocol.text import UNDECODABLE


class RebuiltEnvironment(Struct, frozen=True, kw_only=True):
    """An environment of a table, and what came of building it again.

    Attributes:
        number: from 0.
        same: whether it has the same scene, true joints and numbers.
        differing: how many of its numbers differ.
    """

    number: int
    place: GridPlace
    same: bool
    differing: int

    @property
    def words(self) -> str:
        """The comparison for people."""
        place = self.place
        who = f"environment {self.number} ({place.split}, identity {place.identity}, pose {place.pose})"
        if self.same:
            return f"{who}: the same bytes"
        return f"{who}: {self.differing} numbers differ" if self.differing else f"{who}: another scene"


class TableCheck(Struct, frozen=True, kw_only=True):
    """A table, and the environments of it that were built again.

    Attributes:
        packages: the libraries that have another version now than when the table was built.
    """

    table: str
    environments: tuple[RebuiltEnvironment, ...]
    packages: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Whether all of them have the table's bytes."""
        return all(one.same for one in self.environments)

    @property
    def words(self) -> str:
        """The check for people."""
        found = [one.words for one in self.environments]
        if self.packages and not self.same:
            found.append(f"other versions now than when the table was built: {', '.join(self.packages)}")
        return "\n".join(found)


def settings_of(table: StoredGridTable, path: Path) -> tuple[RunConfig, GridViews]:
    """The configuration of the workers, and the views, by which a table was built.

    Args:
        path: of the table, for messages.

    Raises:
        InvalidInput: its recipe can't be read, is that of another table, or names a file by its checksum.
        InvalidConfig: the configuration is none of this version.
    """
    config = recorded_config(table.recipe.config.encode(), path)
    for setting in path_settings(config):
        if setting.value and is_checksum(setting.value):
            raise InvalidInput(f"{path} was built with {setting.mark.noun} {setting.value}, which this command lacks")
    try:
        views = msgspec.json.decode(table.recipe.views, type=GridViews)
    except UNDECODABLE as error:
        raise InvalidInput(f"{path} has views that this version can't read: {error}") from error
    if views.count != len(table.places):
        raise InvalidInput(f"{path} has {len(table.places)} environments, and another recipe: {views.words}")
    # A table does not depend on how many requests are in hand, so its recipe does not say it.
    return replace(config, perception=replace(config.perception, prefetch=PerceptionConfig().prefetch)), views


def require_alike(recipe: GridRecipe, capabilities: Mapping[str, str]) -> None:
    """Raise `InvalidInput` if the perception workers are others than a recipe's."""
    if differing := differences(recipe.perception, capabilities):
        raise InvalidInput(f"the perception workers differ from those of the table in {', '.join(differing)}")


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """The names that had another value then, with both values."""
    names = sorted(then.keys() | now.keys())
    return tuple(f"{name} ({then.get(name)}, now {now.get(name)})" for name in names if then.get(name) != now.get(name))


def spread_over(count: int, wanted: int) -> tuple[int, ...]:
    """The numbers of up to `wanted` of a table's environments: from the first to the last, at even distances."""
    return tuple(np.unique(np.linspace(0, count - 1, min(wanted, count)).round().astype(int)).tolist())


def compared(
    table: StoredGridTable, numbers: Sequence[int], rebuilt: Iterable[ObservedEnvironment]
) -> Iterator[RebuiltEnvironment]:
    """Compare environments that were built again with those of a table.

    Args:
        numbers: which environments of the table, in the order of `rebuilt`.
    """
    for number, again in zip(numbers, rebuilt, strict=True):
        told = of_names(table.quantities, again.quantities)
        yield _compared(number, table.places[number], stored_place(again.place, again.truth, told))


def _compared(number: int, shipped: StoredPlace, again: StoredPlace) -> RebuiltEnvironment:
    before, after = (np.frombuffer(stored_numbers(one), np.uint8) for one in (shipped, again))
    differing = int((before != after).sum()) if before.size == after.size else max(before.size, after.size)
    same = not differing and (shipped.place, shipped.truth) == (again.place, again.truth)
    return RebuiltEnvironment(number=number, place=shipped.place, same=same, differing=differing)
