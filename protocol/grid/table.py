"""A table of the views around people, one from each cell of a grid: what `vantage/Grid-v0` walks on.

`orchestrator experiment grid build` makes the file, the agent reads it. Numbers are stored in a byte each, so that a
table can ship; every use of a table, its making included, sees the numbers as they were stored.
"""

import hashlib
import lzma
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from protocol.arrays import Float32Array
from protocol.errors import ArtifactDamaged
from protocol.scene import TEST_IDENTITIES, TEST_POSES, TRAIN_IDENTITIES, TRAIN_POSES, Split
from protocol.skeleton import JOINT_COUNT
from protocol.text import UNDECODABLE

FORMAT = 1

SIDE = 19
"""Cells along each side, one metre each; the person stands in the middle one. Source: thesis, section 4.3.4."""

CELLS = SIDE * SIDE

LARGEST_FILE = 64 * 1024 * 1024
"""Bytes; a larger file is no table."""

Quantity: TypeAlias = Literal["mass", "height", "distance", "expected_error", "radius", "error"]
SHARES: tuple[Quantity, ...] = ("mass", "height", "distance")
"""Qualities from 0 to 1, stored in steps of 1/255."""

LENGTHS: tuple[Quantity, ...] = ("expected_error", "radius", "error")
"""Metres, stored in steps of 3.5% from a millimetre on; NaN where there is no estimate."""

QUANTITIES: tuple[Quantity, ...] = SHARES + LENGTHS

_SHORTEST, _RATIO = 0.001, 1.035
_NO_LENGTH = 255

_MOST_NUMBERS = len(QUANTITIES) * JOINT_COUNT * CELLS + 1
"""One more than an environment has at most, so that views too many are noticed."""

_OF_SPLIT: Mapping[Split, tuple[range, range]] = {
    "train": (TRAIN_IDENTITIES, TRAIN_POSES),
    "test": (TEST_IDENTITIES, TEST_POSES),
}
"""Identities and poses."""

Certainty: TypeAlias = Literal["quality", "metres"]
"""Of a joint: the thesis's combined quality, or the expected error in metres."""

ERROR_SCALE = 0.1
"""Metres of expected error at which a joint counts as unknown: an uncertainty of 1."""

_Index = Annotated[int, Meta(ge=0, lt=2**31)]


class GridRecipe(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a table is made; the same recipe gives the same bytes on the same kind of machine.

    Attributes:
        certainty: what an uncertainty is computed from.
        version: of Vantage.
        config: the configuration of the workers, in TOML.
        views: the settings of the views, in JSON.
        perception: the capabilities of the perception workers.
        packages: the versions of the libraries.
    """

    certainty: Certainty
    version: str
    config: str
    views: str
    perception: dict[str, str]
    packages: dict[str, str] = {}


class GridPlace(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One environment of a table: a person in a pose, turned by some yaw, before a background.

    Attributes:
        seed: of the scene, from which all of it follows.
        pose: the kind of pose.
        yaw: radians, counter-clockwise from the grid's x axis to where the person faces.
    """

    split: Split
    seed: _Index
    identity: _Index
    pose: _Index
    yaw: float


class StoredPlace(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An environment with its views: each quantity of every cell and joint, a byte each, compressed."""

    place: GridPlace
    truth: bytes
    views: bytes


class StoredGridTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All of a table's file; `checksum` is the sha256 of the environments."""

    format: int = FORMAT
    recipe: GridRecipe
    quantities: tuple[Quantity, ...]
    places: tuple[StoredPlace, ...]
    checksum: str


class GridTable(Struct, frozen=True, eq=False, kw_only=True):
    """The views of all environments.

    Cell `x + 9 + 19 * (y + 9)` is the one whose centre is x metres and y metres from the person.

    Attributes:
        recipe: how it was made.
        places: the environments, those of the train split first.
        truth: (n, 18, 3) the joints' true positions, metres, from the person's place on the ground.
        quantities: (n, 361, 18) each, by name.
    """

    recipe: GridRecipe
    places: tuple[GridPlace, ...]
    truth: Float32Array
    quantities: Mapping[Quantity, Float32Array]

    def of_split(self, split: Split) -> NDArray[np.intp]:
        """The numbers of the split's environments."""
        return np.array([number for number, place in enumerate(self.places) if place.split == split], np.intp)

    def uncertainties(self) -> Float32Array:
        """(n, 361, 18) from 0 to 1: one minus the combined quality, or the expected error over `ERROR_SCALE`.

        A joint without an estimate has 1. Source: thesis, section 3.3.3.
        """
        if self.recipe.certainty == "quality":
            shares = np.stack([self.quantities[name] for name in SHARES])
            return np.float32(1.0) - shares.mean(axis=0, dtype=np.float32)
        errors = np.nan_to_num(self.quantities["expected_error"], nan=np.inf)
        return np.minimum(errors / np.float32(ERROR_SCALE), np.float32(1.0))


def cell_of(x: int, y: int) -> int:
    """The number of the cell at x and y metres from the person, each from -9 to 9."""
    return x + SIDE // 2 + SIDE * (y + SIDE // 2)


CENTRE = cell_of(0, 0)


def stored_place(place: GridPlace, truth: Float32Array, quantities: Mapping[Quantity, Float32Array]) -> StoredPlace:
    """An environment as the file has it.

    Args:
        truth: (18, 3) metres, from the person's place on the ground.
        quantities: (361, 18) each, by name.

    Raises:
        ArtifactDamaged: an array has another shape, as when a view is missing.
    """
    for name, values in quantities.items():
        if values.shape != (CELLS, JOINT_COUNT):
            raise ArtifactDamaged(f"{_named(place)} has {name} of shape {values.shape}: a view is missing")
    encoded = b"".join(_encoded(name, quantities[name]).T.tobytes() for name in sorted(quantities))
    return StoredPlace(place=place, truth=truth.astype("<f4").tobytes(), views=lzma.compress(encoded, preset=9))


def write_table(path: Path, recipe: GridRecipe, names: Sequence[Quantity], places: Sequence[StoredPlace]) -> None:
    """Write a table's file; `path` is written directly (see `protocol.artifact.whole_file`)."""
    stored = StoredGridTable(
        recipe=recipe, quantities=tuple(sorted(names)), places=tuple(places), checksum=_checksum(places)
    )
    path.write_bytes(msgspec.msgpack.encode(stored))


def read_table(path: Path) -> GridTable:
    """A table out of its file.

    Raises:
        ArtifactDamaged: as `read_stored_table`; or an environment has a view too few.
    """
    stored = read_stored_table(path)
    arrays = [_decoded_place(one, stored.quantities) for one in stored.places]
    return GridTable(
        recipe=stored.recipe,
        places=tuple(one.place for one in stored.places),
        truth=np.stack([truth for truth, _ in arrays]),
        quantities={name: np.stack([values[name] for _, values in arrays]) for name in stored.quantities},
    )


def read_stored_table(path: Path) -> StoredGridTable:
    """A table as stored, its checksum verified.

    Raises:
        ArtifactDamaged: the file can't be read, is no table or was changed, or its splits are not apart.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ArtifactDamaged(f"{path} is too large to be a grid table")
        stored = msgspec.msgpack.decode(path.read_bytes(), type=StoredGridTable)
    except OSError as error:
        raise ArtifactDamaged(f"{path} can't be read: {error.strerror}") from error
    except UNDECODABLE as error:
        raise ArtifactDamaged(f"{path} is no grid table: {error}") from error
    if stored.format != FORMAT:
        raise ArtifactDamaged(f"{path} has the format {stored.format}, not {FORMAT}; build it anew")
    if _checksum(stored.places) != stored.checksum:
        raise ArtifactDamaged(f"{path} is not what was built: its checksum differs")
    _require_quantities(stored, path)
    require_splits_apart([one.place for one in stored.places])
    return stored


def stored_numbers(stored: StoredPlace) -> bytes:
    """An environment's quantities, in the order of their names, a byte for each joint and cell.

    Raises:
        ArtifactDamaged: they can't be unpacked.
    """
    try:
        return lzma.LZMADecompressor().decompress(stored.views, max_length=_MOST_NUMBERS)
    except lzma.LZMAError as error:
        raise ArtifactDamaged(f"{_named(stored.place)} has views that can't be unpacked: {error}") from error


def require_splits_apart(places: Sequence[GridPlace]) -> None:
    """Make sure that there are environments of both splits, each of its split's own people and poses.

    Raises:
        ArtifactDamaged: there are not; the message names the environment.
    """
    people = {split: {place.identity for place in places if place.split == split} for split in _OF_SPLIT}
    for split, identities in people.items():
        if not identities:
            raise ArtifactDamaged(f"the {split} split has no environment")
    if both := people["train"] & people["test"]:
        raise ArtifactDamaged(f"identity {min(both)} is in both splits; a policy is tested on other people")
    for place in places:
        identities, poses = _OF_SPLIT[place.split]
        if place.identity not in identities or place.pose not in poses:
            raise ArtifactDamaged(f"{_named(place)} is in the {place.split} split, whose people or poses are others")


def _require_quantities(stored: StoredGridTable, path: Path) -> None:
    needed = SHARES if stored.recipe.certainty == "quality" else ("expected_error",)
    if lacking := [name for name in needed if name not in stored.quantities]:
        raise ArtifactDamaged(f"{path} lacks {', '.join(lacking)}; its certainty is in {stored.recipe.certainty}")


def _named(place: GridPlace) -> str:
    return f"the environment of identity {place.identity}, pose {place.pose}, seed {place.seed}"


def _decoded_place(stored: StoredPlace, names: Sequence[Quantity]) -> tuple[Float32Array, dict[Quantity, Float32Array]]:
    encoded = np.frombuffer(stored_numbers(stored), np.uint8)
    if encoded.size != len(names) * JOINT_COUNT * CELLS:
        raise ArtifactDamaged(
            f"{_named(stored.place)} has {encoded.size} numbers, not {len(names) * JOINT_COUNT * CELLS}: "
            "a view is missing"
        )
    if len(stored.truth) != 4 * 3 * JOINT_COUNT:
        raise ArtifactDamaged(f"{_named(stored.place)} lacks the true position of a joint")
    bytes_of = encoded.reshape(len(names), JOINT_COUNT, CELLS)
    truth = np.frombuffer(stored.truth, "<f4").astype(np.float32).reshape(JOINT_COUNT, 3)
    return truth, {name: _decoded(name, bytes_of[number].T) for number, name in enumerate(names)}


def _encoded(name: Quantity, values: Float32Array) -> NDArray[np.uint8]:
    if name in SHARES:
        return np.rint(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)
    steps = np.rint(np.log(np.maximum(np.nan_to_num(values, nan=1.0), _SHORTEST) / _SHORTEST) / np.log(_RATIO))
    return np.where(np.isfinite(values), np.minimum(steps, _NO_LENGTH - 1), _NO_LENGTH).astype(np.uint8)


def _decoded(name: Quantity, encoded: NDArray[np.uint8]) -> Float32Array:
    if name in SHARES:
        return encoded.astype(np.float32) / np.float32(255.0)
    lengths = (_SHORTEST * _RATIO ** np.arange(256)).astype(np.float32)
    lengths[_NO_LENGTH] = np.nan
    return lengths[encoded]


def _checksum(places: Sequence[StoredPlace]) -> str:
    return hashlib.sha256(msgspec.msgpack.encode(places)).hexdigest()
