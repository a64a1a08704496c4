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
"""Every how manyth person the network does not see."""

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
        version: of Vantage, for the file to tell.
        told: given the number of each epoch and its mean loss.
        keep: a file for the training after each epoch, so that who is killed goes on.

    Raises:
        InvalidInput: it is no such table, or has too few people.
    """
    frames = read_frames(path)
    people = np.unique(frames.identity)
    if len(people) < LEAST_PEOPLE:
        raise InvalidInput(f"{path} has {len(people)} people; a lifter takes {LEAST_PEOPLE} or more")
    held_out = people[HELD_OUT - 1 :: HELD_OUT]
    unseen = np.isin(frames.identity, held_out)
    table = sha256(path)
    recipe = msgspec.json.encode(training).decode()
    kept = None if keep is None else Kept(keep, f"{table} {recipe} {msgspec.json.encode(shape).decode()}")
    weights = packed(train(frames.of(~unseen), shape, training, told=told, kept=kept))
    metadata = pq.read_schema(path).metadata or {}
    return StoredLifter(
        setting=_setting(metadata, path),
        provenance=Provenance(
            version=version,
            table=table,
            views=metadata.get(b"vantage.views", b"").decode(),
            training=recipe,
            frames=len(frames),
            fitted_on=tuple(np.setdiff1d(people, held_out).tolist()),
            calibrated_on=tuple(held_out.tolist()),
        ),
        shape=shape,
        weights=weights,
        checksum=checksum_of(weights),
        **_certainties(LifterNetwork(shape, unpacked_arrays(shape, weights)), frames.of(unseen & frames.usual)),
    )


class _Certainties(TypedDict):
    seen: Certainty
    inferred: Certainty
    unmeasured: float


def _certainties(network: LifterNetwork, others: Frames) -> _Certainties:
    """How sure a network is, by people whom it has not seen."""
    trial = tried(network, others)
    seen, inferred = (certainty_of(trial, found=found) for found in (True, False))
    return {"seen": seen, "inferred": inferred, "unmeasured": unmeasured_factor(network, others, seen)}


def _setting(metadata: dict[bytes, bytes], path: Path) -> NetworkSetting:
    """What the workers were that observed all this, as the table tells."""
    encoded = metadata.get(b"vantage.config")
    if encoded is None:
        raise InvalidInput(f"{path} does not tell the configuration that it was made with")
    config = recorded_config(encoded, path)
    return network_setting(settled(config.perception, config.profile))
