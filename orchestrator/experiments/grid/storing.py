"""The file that ships, made from all views of a grid."""

import tomllib
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np
import pyarrow.parquet as pq
import tomli_w

from orchestrator.experiments.grid.columns import environment_in
from orchestrator.experiments.grid.directory import GridDirectory
from protocol.arrays import Float32Array
from protocol.artifact import whole_file
from protocol.config import Profile
from protocol.errors import InvalidInput
from protocol.grid.table import (
    QUANTITIES,
    Certainty,
    GridRecipe,
    Quantity,
    require_splits_apart,
    stored_place,
    write_table,
)

_SECTIONS = {"profile", "render", "perception", "environment", "artifacts"}

CERTAINTIES: Mapping[Profile, Certainty] = {"thesis": "quality", "vantage": "metres"}


def store(directory: GridDirectory) -> None:
    """Make a directory's table of its views, unless it is there.

    Raises:
        DamagedRecord: an environment has a view too few.
        ArtifactDamaged: an environment is in a split of other people and poses.
        InvalidInput: the table's certainty is in metres, and the workers told none.
    """
    if directory.table_path.is_file():
        return
    views = pq.ParquetFile(directory.all_views_path)
    environments = [environment_in(views.read_row_group(number)) for number in range(views.num_row_groups)]
    require_splits_apart([place for place, _, _ in environments])
    told: tuple[Quantity, ...] = tuple(
        name for name in QUANTITIES if any(np.isfinite(values[name]).any() for _, _, values in environments)
    )
    recipe = _recipe(directory.config().profile, views.schema_arrow.metadata)
    if recipe.certainty == "metres" and "expected_error" not in told:
        raise InvalidInput(
            f"{directory.all_views_path} has no expected errors, since its workers are neither calibrated nor have a "
            "learned lifter; a table of the profile vantage needs them"
        )
    places = [stored_place(place, truth, of_names(told, values)) for place, truth, values in environments]
    with whole_file(directory.table_path) as aside:
        write_table(aside, recipe, told, places)


def of_names(names: Sequence[Quantity], quantities: Mapping[Quantity, Float32Array]) -> dict[Quantity, Float32Array]:
    """The quantities of these names."""
    return {name: quantities[name] for name in names}


def _recipe(profile: Profile, metadata: Mapping[bytes, bytes]) -> GridRecipe:
    def text(name: str) -> str:
        return metadata[f"vantage.{name}".encode()].decode()

    def names(name: str) -> dict[str, str]:
        return msgspec.json.decode(text(name), type=dict[str, str])

    return GridRecipe(
        certainty=CERTAINTIES[profile],
        version=text("version"),
        config=_of_views(text("config")),
        views=text("views"),
        perception=names("perception"),
        packages=names("packages"),
    )


def _of_views(config: str) -> str:
    """The sections of a configuration that views depend on: a recipe outlives the settings of learners."""
    return tomli_w.dumps({name: value for name, value in tomllib.loads(config).items() if name in _SECTIONS})
