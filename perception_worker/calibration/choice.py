"""Which calibration a perception worker takes: the one that was fitted for what it does."""

from pathlib import Path

import msgspec

from perception_worker.backend import input_size, network_name, peak_threshold, region_size
from perception_worker.calibration.calibration import Calibration, Setting, read_calibration, shipped
from protocol.config import PerceptionConfig
from protocol.errors import InvalidConfig
from protocol.observation import Lifting


def setting_of(config: PerceptionConfig) -> Setting:
    """What a perception worker of this configuration, settled by its profile, asks of a calibration."""
    rows, columns = input_size(config) or (0, 0)
    region_rows, region_columns = (region_size(config) or (rows, columns)) if config.look == "track" else (0, 0)
    return Setting(
        network=network_name(config),
        rows=rows,
        columns=columns,
        look=config.look,
        region_rows=region_rows,
        region_columns=region_columns,
        peak_threshold=peak_threshold(config),
        lifting=msgspec.convert(config.lifting, Lifting),
    )


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
            f"perception.calibration: {config.calibration} was fitted for {_words(calibration.setting)}, "
            f"this worker has {_words(wanted)}; fit it anew, or choose auto or none"
        )
    return calibration


def _words(setting: Setting) -> str:
    return ", ".join(f"{name} {value}" for name, value in msgspec.structs.asdict(setting).items())
