"""Fits a lifter on a table of views: its network on four of five people, its certainty on the others."""

from collections.abc import Callable
from pathlib import Path
from typing import TypedDict

import msgspec
import numpy as np
import pyarrow.parquet as pq

from perception_worker.lifter.fitting.certainty import certainty_of, tried, unmeasured_factor
from perception_worker.lifter.fitting.frames import Frames, read_frames
from perception_worker.lifter.fitting.training import Kept, Training, train
from perception_worker.lifter.network import LifterNetwork, Shape
from perception_worker.lifter.stored import Certainty, Provenance, StoredLifter, checksum_of, packed, unpacked_arrays
from perception_worker.networks.network_setting import NetworkSetting, network_setting
from protocol.artifact import sha256
from protocol.config import settled
from protocol.config_file import recorded_config
from protocol.errors import InvalidInput

HELD_OUT = 5
"""One person of this many is held out from the network."""

LEAST_PEOPLE = 10
DEFAULT_SHAPE = Shape()


def fit(
    path: Path,
    *,
    version: str,
    training: Training,
    told: Callable[[int, float], None],
    shape: Shape = DEFAULT_SHAPE,
    keep: Path | None = None,
) -> StoredLifter:
    """Fit a lifter.

    Args:
        path: of the table, a Parquet file of `orchestrator lifter fit`.
        version: of Vantage, recorded in the file.
        told: called with the number of each epoch and its mean loss.
        keep: a file that holds the training after each epoch, so that a fit that was killed continues.

    Raises:
        InvalidInput: it is no such table, or has too few people.
    """
    frames, table, recipe = read_frames(path), sha256(path), _json(training)
    fitted_on, calibrated_on = _split_people(frames, path)
    unseen = np.isin(frames.identity, calibrated_on)
    kept = None if keep is None else Kept(keep, f"{table} {recipe} {_json(shape)}")
    weights = packed(train(frames.of(~unseen), shape, training, told=told, kept=kept))
    metadata = pq.read_schema(path).metadata or {}
    provenance = Provenance(
        version=version,
        table=table,
        views=metadata.get(b"vantage.views", b"").decode(),
        training=recipe,
        frames=len(frames),
        fitted_on=fitted_on,
        calibrated_on=calibrated_on,
    )
    return StoredLifter(
        setting=_setting(metadata, path),
        provenance=provenance,
        shape=shape,
        weights=weights,
        checksum=checksum_of(weights),
        **_certainties(LifterNetwork(shape, unpacked_arrays(shape, weights)), frames.of(unseen & frames.usual)),
    )


def _split_people(frames: Frames, path: Path) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The people whom the network is fitted on, and those whom its certainty is calibrated on."""
    people = np.unique(frames.identity)
    if len(people) < LEAST_PEOPLE:
        raise InvalidInput(f"{path} has {len(people)} people; a lifter takes {LEAST_PEOPLE} or more")
    held_out = people[HELD_OUT - 1 :: HELD_OUT]
    return tuple(np.setdiff1d(people, held_out).tolist()), tuple(held_out.tolist())


def _json(recipe: Training | Shape) -> str:
    return msgspec.json.encode(recipe).decode()


class _Certainties(TypedDict):
    seen: Certainty
    inferred: Certainty
    unmeasured: float


def _certainties(network: LifterNetwork, others: Frames) -> _Certainties:
    """How sure a network is, measured on people whom it has not seen."""
    trial = tried(network, others)
    seen, inferred = (certainty_of(trial, found=found) for found in (True, False))
    return {"seen": seen, "inferred": inferred, "unmeasured": unmeasured_factor(network, others, seen)}


def _setting(metadata: dict[bytes, bytes], path: Path) -> NetworkSetting:
    """The setting of the workers that made the table, as recorded in it."""
    encoded = metadata.get(b"vantage.config")
    if encoded is None:
        raise InvalidInput(f"{path} does not tell the configuration that it was made with")
    config = recorded_config(encoded, path)
    return network_setting(settled(config.perception, config.profile))
