"""Which lifter a perception worker takes: the one that was fitted for its setting."""

from importlib import resources
from pathlib import Path

from perception_worker.lifter.lifter import Lifter
from perception_worker.lifter.stored import decoded, read_stored
from perception_worker.networks.network_setting import network_setting
from protocol.config import PerceptionConfig
from protocol.errors import InvalidConfig

_SHIPPED = "shipped"


def open_lifter(config: PerceptionConfig) -> Lifter | None:
    """The lifter that the configuration names; with `auto`, the shipped one that fits it, if there is one.

    Raises:
        InvalidConfig: the file was fitted behind another network or at another size.
        ArtifactDamaged: it can't be read, or is no lifter.
    """
    wanted = network_setting(config)
    if config.lifter == "auto":
        return next((one for one in shipped() if one.setting == wanted), None)
    lifter = Lifter(read_stored(Path(config.lifter)))
    if lifter.setting != wanted:
        raise InvalidConfig(
            f"perception.lifter: {config.lifter} was fitted behind {lifter.setting.words}, "
            f"this worker has {wanted.words}; fit it anew, or choose auto"
        )
    return lifter


def shipped() -> tuple[Lifter, ...]:
    """All lifters that come with the package."""
    folder = resources.files("perception_worker.lifter") / _SHIPPED
    if not folder.is_dir():
        return ()
    files = sorted((file for file in folder.iterdir() if file.name.endswith(".msgpack")), key=lambda file: file.name)
    return tuple(Lifter(decoded(file.read_bytes(), file.name)) for file in files)
