"""Which detector a perception worker takes, with the networks that its configuration names."""

from msgspec.structs import replace

from perception_worker.detection.detectors import Detector, TrackingDetector, WholeFrameDetector
from perception_worker.networks.backend import DEFAULT_SEARCH, DEFAULT_SIZE, input_size, open_network, region_size
from perception_worker.networks.network import Network
from protocol.config import PerceptionConfig


def open_detector(config: PerceptionConfig) -> Detector:
    """The detector that a configuration, settled by its profile, names, with its networks.

    Raises:
        VantageError: as `open_network`.
    """
    whole = open_network(config)
    if config.look == "whole":
        return WholeFrameDetector(whole)
    quick, region = quick_search_size(config), region_size(config)
    closer = whole if region is None else _open_network_at(region, config)
    return TrackingDetector([whole] if quick is None else [_open_network_at(quick, config), whole], closer)


def _open_network_at(size: tuple[int, int], config: PerceptionConfig) -> Network:
    return open_network(replace(config, input_height=size[0], input_width=size[1]))


def quick_search_size(config: PerceptionConfig) -> tuple[int, int] | None:
    """Rows and columns at which a tracking detector first searches a whole frame.

    None where that is `input_size` already: where the configuration or the network names it.
    """
    named = config.input_height is not None or config.input_width is not None or input_size(config) != DEFAULT_SEARCH
    return None if named else DEFAULT_SIZE
