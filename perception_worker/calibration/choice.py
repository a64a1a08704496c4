"""Which calibration a perception worker takes: the one that was fitted for its setting."""

from pathlib import Path

import msgspec

from perception_worker.calibration.calibration import Calibration, Setting, read_calibration, shipped
from perception_worker.lifting import surface_lifting
from perception_worker.networks.network_setting import network_setting
from protocol.config import PerceptionConfig
from protocol.errors import InvalidConfig


def setting_of(config: PerceptionConfig) -> Setting:
    """What a perception worker of this configuration, settled by its profile, needs of a calibration."""
    shown = msgspec.structs.asdict(network_setting(config))
    return Setting(**shown, lifting=surface_lifting(config))


def open_calibration(config: PerceptionConfig) -> Calibration | None:
    """The calibration that the configuration names; with `auto`, the shipped one that fits it, if there is one.

    Raises:
        InvalidConfig: the file can't be read, or was fitted for another setting.
        ArtifactDamaged: it is no calibration.
    """
    wanted = setting_of(config)
    if config.calibration == "none":
        return None
    if config.calibration == "auto":
        return next((one for one in shipped() if one.setting == wanted), None)
    calibration = read_calibration(Path(config.calibration))
    if calibration.setting != wanted:
        raise InvalidConfig(
            f"perception.calibration: {config.calibration} was fitted for {calibration.setting.words}, "
            f"this worker has {wanted.words}; fit it anew, or choose auto or none"
        )
    return calibration
