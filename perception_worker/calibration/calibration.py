"""An uncertainty in metres: the expected distance of a joint from its estimate, and a radius that holds it.

Fitted on people whose truth is known (`perception_worker.calibration.fitting`); valid for the network and the way of
lifting that it was fitted with. The radius is conformal: over people and views like those, it holds nine joints of ten.
"""

from importlib import resources
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta, Struct

from perception_worker.calibration.ensemble import Ensemble, StoredEnsemble
from perception_worker.calibration.features import FEATURES, joint_features
from perception_worker.networks.network_setting import NetworkSetting
from protocol.arrays import Float64Array
from protocol.camera import Vector3
from protocol.errors import ArtifactDamaged, InvalidConfig
from protocol.pose_estimate import Lifting
from protocol.quantities import Factor
from protocol.skeleton import JOINT_COUNT
from protocol.text import UNDECODABLE

FORMAT = 1
LARGEST_ERROR = 1.5
"""Metres. A joint on the wall behind may be five metres off; it counts as this much, so that few don't decide all."""

_SHIPPED = "shipped"


class Setting(NetworkSetting, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a calibration depends on: with another setting, the same features mean other errors."""

    lifting: Lifting


class Provenance(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The origin of a calibration.

    Attributes:
        version: of Vantage.
        table: sha256 of the table that it was fitted on.
        frames: in the table; `joints`: located ones among them.
        fitted_on, calibrated_on: identities, by their numbers.
        depth_noise: kinds in the table.
    """

    version: str
    table: str
    frames: int
    joints: int
    fitted_on: tuple[int, ...]
    calibrated_on: tuple[int, ...]
    depth_noise: tuple[str, ...]


class StoredCalibration(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A calibration as stored in its file.

    Attributes:
        features: the columns that the trees ask for, by name.
        error: the expected error, metres.
        reach: the error that nine of ten stay below, metres, before calibration on other people.
        factor: (18,) by which that calibration multiplies `reach` for each joint.
    """

    format: int = FORMAT
    setting: Setting
    provenance: Provenance
    features: tuple[str, ...]
    error: StoredEnsemble
    reach: StoredEnsemble
    factor: Annotated[tuple[Factor, ...], Meta(min_length=JOINT_COUNT, max_length=JOINT_COUNT)]


class Calibrated(NamedTuple):
    """(18,) metres each, NaN where a joint was not located."""

    expected_error: Float64Array
    radius: Float64Array


class Calibration:
    """Predicts errors in metres from the features of a lifted frame; may be used by several threads at once."""

    def __init__(self, stored: StoredCalibration) -> None:
        """Open a stored calibration.

        Raises:
            ArtifactDamaged: it uses unknown features.
        """
        if stored.format != FORMAT or stored.features != FEATURES:
            raise ArtifactDamaged("the calibration was made for another version of Vantage; fit it anew")
        self.setting = stored.setting
        self.provenance = stored.provenance
        self._error = Ensemble(stored.error, len(FEATURES))
        self._reach = Ensemble(stored.reach, len(FEATURES))
        self._factor = np.array(stored.factor)

    def calibrate(
        self,
        points: Float64Array,
        *,
        mass: Float64Array,
        height: Float64Array,
        distance: Float64Array,
        spread: Float64Array,
        camera: Vector3,
    ) -> Calibrated:
        """The expected error and the radius of each joint; arguments as for `joint_features`."""
        error, radius = np.full(JOINT_COUNT, np.nan), np.full(JOINT_COUNT, np.nan)
        located = np.isfinite(points[:, 0])
        if located.any():
            features = joint_features(
                points, mass=mass, height=height, distance=distance, spread=spread, camera=camera
            )[located]
            error[located] = np.maximum(self._error.predict(features), 0.0)
            radius[located] = np.maximum(self._reach.predict(features), 0.0) * self._factor[located]
        return Calibrated(error, radius)


def shipped() -> list[Calibration]:
    """All calibrations that come with the package."""
    folder = resources.files("perception_worker.calibration") / _SHIPPED
    files = sorted((file for file in folder.iterdir() if file.name.endswith(".msgpack")), key=lambda file: file.name)
    return [Calibration(_decode(file.read_bytes(), file.name)) for file in files]


def read_calibration(path: Path) -> Calibration:
    """Read a calibration's file.

    Raises:
        InvalidConfig: it can't be read.
        ArtifactDamaged: it is no calibration.
    """
    try:
        encoded = path.read_bytes()
    except OSError as error:
        raise InvalidConfig(f"perception.calibration: can't read {path}: {error.strerror}") from error
    return Calibration(_decode(encoded, str(path)))


def _decode(encoded: bytes, name: str) -> StoredCalibration:
    try:
        return msgspec.msgpack.decode(encoded, type=StoredCalibration)
    except UNDECODABLE as error:
        raise ArtifactDamaged(f"{name} is no calibration: {error}") from error
