"""What a worker's keypoints depend on: a model fitted on its keypoints fits no other setting."""

import msgspec
from msgspec import Struct

from perception_worker.networks.backend import input_size, network_name, peak_threshold, region_size
from protocol.config import PerceptionConfig


class NetworkSetting(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The network, and the size of its inputs.

    Attributes:
        rows, columns: of the network's input for whole frames; 0 where its file decides.
        region_rows, region_columns: of its input for regions; 0 where it gets none.
    """

    network: str
    rows: int
    columns: int
    look: str
    region_rows: int
    region_columns: int
    peak_threshold: float

    @property
    def words(self) -> str:
        """The setting in words, for messages."""
        return ", ".join(f"{name} {value}" for name, value in msgspec.structs.asdict(self).items())


def network_setting(config: PerceptionConfig) -> NetworkSetting:
    """The setting of a perception worker of this configuration, settled by its profile."""
    rows, columns = input_size(config) or (0, 0)
    region_rows, region_columns = (region_size(config) or (rows, columns)) if config.look == "track" else (0, 0)
    return NetworkSetting(
        network=network_name(config),
        rows=rows,
        columns=columns,
        look=config.look,
        region_rows=region_rows,
        region_columns=region_columns,
        peak_threshold=peak_threshold(config),
    )
