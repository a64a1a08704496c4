"""Small trees, and a calibration made of them."""

from perception_worker.calibration.calibration import Provenance, Setting, StoredCalibration
from perception_worker.calibration.ensemble import StoredEnsemble, stored_ensemble
from perception_worker.calibration.features import FEATURES
from protocol.skeleton import JOINT_COUNT

SETTING = Setting(
    network="openpose_mobilenet_thin",
    rows=240,
    columns=320,
    look="whole",
    region_rows=0,
    region_columns=0,
    peak_threshold=0.1,
    lifting="nearest",
)


def split(feature: str, threshold: float, left, right):
    """An inner node as LightGBM dumps it; what is not a node is a leaf's value."""
    return {
        "split_feature": FEATURES.index(feature),
        "threshold": threshold,
        "left_child": left if isinstance(left, dict) else {"leaf_value": left},
        "right_child": right if isinstance(right, dict) else {"leaf_value": right},
    }


def constant(value: float) -> StoredEnsemble:
    return stored_ensemble([{"leaf_value": value}], 1)


def stored(
    error: StoredEnsemble | None = None, reach: StoredEnsemble | None = None, setting: Setting = SETTING, **changed
) -> StoredCalibration:
    """A calibration; without trees of its own every error is 0.1 m and every reach 0.2 m."""
    fields = {
        "setting": setting,
        "provenance": Provenance(
            version="0",
            table="0" * 64,
            frames=1,
            joints=18,
            fitted_on=(0,),
            calibrated_on=(1,),
            depth_noise=("none",),
        ),
        "features": FEATURES,
        "error": error or constant(0.1),
        "reach": reach or constant(0.2),
        "factor": (1.5,) * JOINT_COUNT,
    }
    return StoredCalibration(**(fields | changed))
