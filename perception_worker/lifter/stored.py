"""A lifter as stored in its file, with its setting and its origin."""

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct

from perception_worker.lifter.network import Shape, Weights
from perception_worker.lifter.tokens import TOKEN_SIZE
from perception_worker.networks.network_setting import NetworkSetting
from protocol.arrays import Float32Array
from protocol.errors import ArtifactDamaged
from protocol.quantities import Factor
from protocol.skeleton import JOINT_COUNT
from protocol.text import UNDECODABLE

FORMAT = 1

LARGEST_FILE = 8 * 1024 * 1024
"""Bytes; a larger file is no lifter."""

Factors = Annotated[tuple[Factor, ...], Meta(min_length=JOINT_COUNT, max_length=JOINT_COUNT)]


class Provenance(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The origin of a lifter.

    Attributes:
        version: of Vantage.
        table: sha256 of the table that it was fitted on.
        views: the settings of that table, in JSON; `orchestrator lifter fit` makes the table again from them.
        training: how its network learned, in JSON.
        frames: with a person in them.
        fitted_on, calibrated_on: identities, by their numbers.
    """

    version: str
    table: str
    views: str
    training: str
    frames: int
    fitted_on: tuple[int, ...]
    calibrated_on: tuple[int, ...]


class Certainty(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The factors of a network's scale, for each joint.

    Attributes:
        error: scale to expected error.
        radius: scale to the radius that holds the joint nine times of ten.
    """

    error: Factors
    radius: Factors


class StoredLifter(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All of a lifter.

    Attributes:
        setting: the network that it was fitted behind.
        tokens: numbers in a token.
        weights: arrays by their names, float16, little-endian.
        checksum: sha256 of the weights in the order of their names.
        seen, inferred: for joints that were found, and for those that were not.
        unmeasured: a further factor of radii and errors where no depth was measured.
    """

    format: int = FORMAT
    setting: NetworkSetting
    provenance: Provenance
    tokens: int = TOKEN_SIZE
    shape: Shape
    weights: dict[str, bytes]
    checksum: str
    seen: Certainty
    inferred: Certainty
    unmeasured: Factor


def packed(weights: Weights) -> dict[str, bytes]:
    """The arrays as a file has them."""
    return {name: array.astype("<f2").tobytes() for name, array in weights.items()}


def unpacked(stored: StoredLifter) -> dict[str, Float32Array]:
    """The arrays of a file.

    Raises:
        ArtifactDamaged: they are not those that it was made with, or it is of another version.
    """
    if (stored.format, stored.tokens) != (FORMAT, TOKEN_SIZE):
        raise ArtifactDamaged("the lifter was made for another version of Vantage; fit it anew")
    if checksum_of(stored.weights) != stored.checksum:
        raise ArtifactDamaged("the lifter's weights are not those that it was made with")
    return unpacked_arrays(stored.shape, stored.weights)


def unpacked_arrays(shape: Shape, weights: Mapping[str, bytes]) -> dict[str, Float32Array]:
    """Arrays of these shapes.

    Raises:
        ArtifactDamaged: there are others, or one has a value that is not finite.
    """
    arrays: dict[str, Float32Array] = {}
    for name, size in shape.parameters().items():
        encoded = weights.get(name, b"")
        if len(encoded) != 2 * math.prod(size):
            raise ArtifactDamaged(f"the lifter's weights {name} don't have the shape {size}")
        arrays[name] = np.frombuffer(encoded, "<f2").astype(np.float32).reshape(size)
        if not np.isfinite(arrays[name]).all():
            raise ArtifactDamaged(f"the lifter's weights {name} have values that are not finite")
    return arrays


def checksum_of(weights: Mapping[str, bytes]) -> str:
    """sha256 of packed arrays, in hexadecimal."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        digest.update(name.encode() + b"\0" + weights[name])
    return digest.hexdigest()


def decoded(encoded: bytes, name: str) -> StoredLifter:
    """A file's lifter.

    Raises:
        ArtifactDamaged: it is not a lifter.
    """
    try:
        return msgspec.msgpack.decode(encoded, type=StoredLifter)
    except UNDECODABLE as error:
        raise ArtifactDamaged(f"{name} is no lifter: {error}") from error


def read_stored(path: Path) -> StoredLifter:
    """A lifter out of its file.

    Raises:
        ArtifactDamaged: the file can't be read, or is no lifter.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ArtifactDamaged(f"{path} is too large to be a lifter")
        return decoded(path.read_bytes(), str(path))
    except OSError as error:
        raise ArtifactDamaged(f"{path} can't be read: {error.strerror}") from error
