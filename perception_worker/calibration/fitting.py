"""Fits a calibration on a table of the experiment `qoe`, flown on train identities.

Trees are fitted on three of four people. The others, whom they have not seen, tell by how much the reach has to be
multiplied to hold nine of ten joints: for each kind of joint by itself (split conformal prediction, Mondrian by joint).
So the radius also holds for people never seen, as far as they are like these.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import lightgbm
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from perception_worker.calibration.calibration import (
    LARGEST_ERROR,
    Provenance,
    Setting,
    StoredCalibration,
)
from perception_worker.calibration.choice import setting_of
from perception_worker.calibration.conformal import COVERAGE, conformal_quantile
from perception_worker.calibration.ensemble import Ensemble, StoredEnsemble, stored_ensemble
from perception_worker.calibration.features import FEATURES, KIND, joint_features
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.artifact import sha256
from protocol.config import settled
from protocol.config_file import recorded_config
from protocol.errors import InvalidInput
from protocol.skeleton import JOINT_COUNT

LEARNING_RATE = 0.15
HELD_OUT = 4
"""One person of this many is held out from the trees."""

LEAST_PEOPLE = 8


class Growth(NamedTuple):
    """How many trees, and how many levels each. Their answer for a frame may take a quarter of a millisecond."""

    trees: int
    depth: int


ERROR_GROWTH = Growth(trees=100, depth=6)
REACH_GROWTH = Growth(trees=60, depth=5)
_LEAST_REACH = 1e-3


@dataclass(frozen=True, eq=False)
class Joints:
    """Located joints out of a table.

    Attributes:
        features: (n, features) as `FEATURES` names them.
        error: (n,) metres from the truth.
        joint: (n,) which of the 18.
        identity: (n,) whose.
    """

    features: Float32Array
    error: Float64Array
    joint: NDArray[np.int64]
    identity: NDArray[np.int64]

    def of(self, chosen: BoolArray) -> "Joints":
        """Some of them."""
        return Joints(self.features[chosen], self.error[chosen], self.joint[chosen], self.identity[chosen])


def fit(path: Path, *, version: str) -> StoredCalibration:
    """Fit a calibration.

    Args:
        path: of the table, a Parquet file that `orchestrator experiment qoe --split train` has made.
        version: of Vantage, recorded in the file.

    Raises:
        InvalidInput: it is no such table, or has too few people.
    """
    table = _read(path)
    joints = located_joints(table)
    fitted_on, calibrated_on = _split_people(joints, path)
    unseen = np.isin(joints.identity, calibrated_on)
    seen, others = joints.of(~unseen), joints.of(unseen)
    error = _trees(ERROR_GROWTH, seen.features, np.minimum(seen.error, LARGEST_ERROR), objective="regression")
    reach = _trees(REACH_GROWTH, seen.features, seen.error, objective="quantile", alpha=COVERAGE)
    provenance = Provenance(
        version=version,
        table=sha256(path),
        frames=table.num_rows // JOINT_COUNT,
        joints=len(joints.error),
        fitted_on=fitted_on,
        calibrated_on=calibrated_on,
        depth_noise=tuple(sorted(table["depth_noise"].unique().to_pylist())),
    )
    return StoredCalibration(
        setting=_setting(table, path),
        provenance=provenance,
        features=FEATURES,
        error=error,
        reach=reach,
        factor=conformal_factors(Ensemble(reach, len(FEATURES)).predict(others.features), others),
    )


def _split_people(joints: Joints, path: Path) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The people whom the trees are fitted on, and those whom the reach is calibrated on."""
    people = np.unique(joints.identity)
    if len(people) < LEAST_PEOPLE:
        raise InvalidInput(f"{path} has {len(people)} people; a calibration takes {LEAST_PEOPLE} or more")
    held_out = people[HELD_OUT - 1 :: HELD_OUT]
    return tuple(np.setdiff1d(people, held_out).tolist()), tuple(held_out.tolist())


def conformal_factors(reach: Float64Array, joints: Joints) -> tuple[float, ...]:
    """For each of the 18 joints, the factor by which `reach` holds `COVERAGE` of the errors of its kind.

    Args:
        reach: (n,) metres, as predicted for these joints by trees that have not seen their people.

    Raises:
        InvalidInput: a kind of joint is not among them often enough.
    """
    ratio = joints.error / np.maximum(reach, _LEAST_REACH)
    kind = KIND[joints.joint]
    return tuple(conformal_quantile(ratio[kind == own]) for own in KIND)


def located_joints(table: pa.Table) -> Joints:
    """The joints of a table that were located, with their features."""
    joint, identity, error = (_by_frame(table, name) for name in ("joint", "identity", "error"))
    located = np.isfinite(error)
    features = np.zeros((*error.shape, len(FEATURES)), np.float32)
    points, camera = (_points(table, prefix) for prefix in ("", "camera_"))
    mass, height, distance, spread = (
        _by_frame(table, name) for name in ("mass", "height", "distance_quality", "spread")
    )
    for frame in np.flatnonzero(located.any(axis=1)):
        features[frame] = joint_features(
            points[frame],
            mass=mass[frame],
            height=height[frame],
            distance=distance[frame],
            spread=spread[frame],
            camera=tuple(camera[frame, 0]),
        )
    return Joints(features[located], error[located], joint[located].astype(np.int64), identity[located].astype(int))


def _read(path: Path) -> pa.Table:
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InvalidInput(f"{path} is no table of an experiment: {error}") from error
    lacking = {"joint", "error", "spread", "camera_x", "depth_noise"} - set(table.column_names)
    if lacking or table.num_rows == 0 or table.num_rows % JOINT_COUNT:
        raise InvalidInput(f"{path} is no table of 'orchestrator experiment qoe'")
    _require_surfaces(table, path)
    return table


def _setting(table: pa.Table, path: Path) -> Setting:
    """The setting of the workers that made the table, as recorded in it."""
    encoded = (table.schema.metadata or {}).get(b"vantage.config")
    if encoded is None:
        raise InvalidInput(f"{path} does not tell the configuration that it was made with")
    config = recorded_config(encoded, path)
    return setting_of(settled(config.perception, config.profile))


def _require_surfaces(table: pa.Table, path: Path) -> None:
    """Refuse tables of a learned lifter, which tells errors in metres itself; they are not those of a surface."""
    if "lifting" in table.column_names and "learned" in table["lifting"].unique().to_pylist():
        raise InvalidInput(
            f'{path} is of joints that a learned lifter placed; observe them with perception.lifting = "nearest"'
        )


def _by_frame(table: pa.Table, column: str) -> Float64Array:
    return table[column].to_numpy().astype(np.float64).reshape(-1, JOINT_COUNT)


def _points(table: pa.Table, prefix: str) -> Float64Array:
    return np.stack([_by_frame(table, f"{prefix}{axis}") for axis in "xyz"], axis=2)


def _trees(growth: Growth, features: Float32Array, target: Float64Array, **objective: Any) -> StoredEnsemble:
    settings = {
        "num_leaves": 2**growth.depth,
        "max_depth": growth.depth,
        "learning_rate": LEARNING_RATE,
        "min_data_in_leaf": 40,
        "use_missing": False,
        "deterministic": True,
        "force_row_wise": True,
        "num_threads": 1,
        "seed": 0,
        "verbosity": -1,
    }
    booster = lightgbm.train(settings | objective, lightgbm.Dataset(features, target), growth.trees)
    trees = [tree["tree_structure"] for tree in booster.dump_model()["tree_info"]]
    return stored_ensemble(trees, growth.depth)
