"""The network that a configuration names, on the library that runs it on this machine."""

import importlib.util
import logging
from pathlib import Path

from perception_worker.networks.engine import Engine
from perception_worker.networks.layout import find_layout, require_covering
from perception_worker.networks.models import KNOWN, OPENPOSE_MOBILENET_THIN, OPENPOSE_MOBILENET_THIN_5, require_network
from perception_worker.networks.network import Network
from perception_worker.networks.openpose_network import OpenPoseNetwork
from perception_worker.networks.single_person_network import (
    BLAZEPOSE,
    MOVENET_LIGHTNING,
    MOVENET_THUNDER,
    SinglePersonKind,
    SinglePersonNetwork,
)
from protocol.config import NETWORK_FILE, PerceptionConfig, Pixels
from protocol.errors import InvalidConfig, Unavailable
from protocol.system.cores import available_cores
from protocol.system.home import home_at_hand
from protocol.text import readable

_logger = logging.getLogger(__name__)

DEFAULT_SIZE = 240, 320
"""Rows and columns of a whole frame where the configuration names none and the network takes any."""

DEFAULT_SEARCH = 320, 424
"""Likewise, of a whole frame that is only searched for the person, where a search at `DEFAULT_SIZE` found none."""

DEFAULT_REGION = 176, 120
"""Likewise, of the region around a person, who is taller than wide (docs/decisions/0210)."""

_OPENPOSE_THRESHOLD = 0.1

_SINGLE_PERSON: dict[str, SinglePersonKind] = {
    "movenet_lightning": MOVENET_LIGHTNING,
    "movenet_thunder": MOVENET_THUNDER,
    "blazepose_full": BLAZEPOSE,
}


def open_network(config: PerceptionConfig) -> Network:
    """Load the network that the configuration names, on the backend that it names.

    `auto` is ONNX Runtime where it can use a GPU, and OpenVINO elsewhere.

    Raises:
        ArtifactMissing: a network known by name was not pulled yet.
        ArtifactDamaged: its checksum is wrong.
        InvalidConfig: another network's file is missing, can't be read, takes other pictures than ours or gives other
            maps; the network is not made for what the configuration says of it; or the backend has no such precision.
        Unavailable: the backend is not installed.
    """
    name = network_name(config)
    if name in _SINGLE_PERSON:
        return _open_single_person(name, _SINGLE_PERSON[name], config)
    file = _network_file(config)
    engine = _open_engine(file, _wanted_size(config), config)
    layout = find_layout(engine.outputs, file, config.layout)
    require_covering(layout, engine.outputs, engine.input_size)
    own_pixels: Pixels = "rgb_imagenet" if layout.name == "trt_pose" else "bgr"
    return OpenPoseNetwork(
        engine,
        layout,
        pixels=own_pixels if config.pixels == "auto" else config.pixels,
        threshold=peak_threshold(config),
        name=name,
    )


def region_size(config: PerceptionConfig) -> tuple[int, int] | None:
    """Rows and columns of a region around a person as the network takes it; None where it takes one size alone."""
    if network_name(config) in _SINGLE_PERSON:
        return None
    if _file_decides(config) and config.region_height is None and config.region_width is None:
        return None
    rows, columns = DEFAULT_REGION
    return config.region_height or rows, config.region_width or columns


def network_name(config: PerceptionConfig) -> str:
    """The name of a settled configuration's network: the one that it is known by, or its file's."""
    if config.network is None:
        return (OPENPOSE_MOBILENET_THIN_5 if config.look == "track" else OPENPOSE_MOBILENET_THIN).name
    return config.network if config.network in KNOWN else readable(Path(config.network).name)


def input_size(config: PerceptionConfig) -> tuple[int, int] | None:
    """Rows and columns of the image that the configuration's network takes; None where its file decides."""
    name = network_name(config)
    return _SINGLE_PERSON[name].size if name in _SINGLE_PERSON else _wanted_size(config)


def peak_threshold(config: PerceptionConfig) -> float:
    """The height that a peak must exceed: the configuration's, or the network's own."""
    if config.peak_threshold is not None:
        return config.peak_threshold
    name = network_name(config)
    return _SINGLE_PERSON[name].threshold if name in _SINGLE_PERSON else _OPENPOSE_THRESHOLD


def _open_single_person(name: str, kind: SinglePersonKind, config: PerceptionConfig) -> Network:
    rows, columns = kind.size
    given = (
        config.input_height or rows,
        config.input_width or columns,
        config.region_height or rows,
        config.region_width or columns,
    )
    if given != (*kind.size, *kind.size):
        raise InvalidConfig(
            f"perception.input_height, input_width, region_height, region_width: {name} takes images of "
            f"{rows}×{columns} and no others; leave them out"
        )
    if (config.layout, config.pixels) != ("auto", "auto"):
        raise InvalidConfig(f"perception.layout, perception.pixels: those of {name} are known; leave both out")
    engine = _open_engine(require_network(KNOWN[name]), kind.size, config)
    return SinglePersonNetwork(engine, kind, threshold=peak_threshold(config), name=name)


def _wanted_size(config: PerceptionConfig) -> tuple[int, int] | None:
    if _file_decides(config) and config.input_height is None and config.input_width is None:
        return None
    rows, columns = DEFAULT_SEARCH if config.look == "track" else DEFAULT_SIZE
    return config.input_height or rows, config.input_width or columns


def _file_decides(config: PerceptionConfig) -> bool:
    return config.network is not None and config.network not in KNOWN


def _network_file(config: PerceptionConfig) -> Path:
    if config.network is None or config.network in KNOWN:
        return require_network(KNOWN[network_name(config)])
    known = ", ".join(KNOWN)
    if not NETWORK_FILE.is_path(config.network):
        raise InvalidConfig(
            f"perception.network: there is no network {config.network}; known are {known}, and a file is named with "
            f"its ending or its folder, as in ./{config.network}"
        )
    file = Path(config.network)
    if not file.is_file():
        raise InvalidConfig(
            f"perception.network: there is no file {file}, and no network of this name; known are {known}"
        )
    return file


def _open_engine(file: Path, size: tuple[int, int] | None, config: PerceptionConfig) -> Engine:
    if config.backend == "openvino":
        return _open_openvino(file, size, config)
    if config.backend == "onnxruntime":
        return _open_onnxruntime(file, size, config)
    return _open_on_gpu(file, size, config) or _open_openvino(file, size, config)


def _open_on_gpu(file: Path, size: tuple[int, int] | None, config: PerceptionConfig) -> Engine | None:
    """The network on a GPU that ONNX Runtime can use; None where it finds none, though it may be built for one."""
    if config.precision != "f32" or importlib.util.find_spec("onnxruntime") is None:
        return None
    from perception_worker.networks.onnxruntime_engine import CPU, OnnxRuntimeEngine, gpu_providers

    if not gpu_providers():
        return None
    engine = OnnxRuntimeEngine(file, input_size=size, default_size=DEFAULT_SIZE, threads=config.threads)
    if engine.provider == CPU:
        return None
    _logger.info("%s runs on ONNX Runtime's %s", file.name, engine.provider)
    return engine


def _open_onnxruntime(file: Path, size: tuple[int, int] | None, config: PerceptionConfig) -> Engine:
    _require_installed("onnxruntime")
    from perception_worker.networks.onnxruntime_engine import OnnxRuntimeEngine

    engine = OnnxRuntimeEngine(file, input_size=size, default_size=DEFAULT_SIZE, threads=config.threads)
    _logger.info("%s runs on ONNX Runtime's %s", file.name, engine.provider)
    return engine


def _open_openvino(file: Path, size: tuple[int, int] | None, config: PerceptionConfig) -> Engine:
    _require_installed("openvino")
    with home_at_hand():
        from perception_worker.networks.openvino_engine import OpenVinoEngine

    engine = OpenVinoEngine(
        file,
        input_size=size,
        default_size=DEFAULT_SIZE,
        precision=config.precision,
        threads=config.threads,
        at_once=_at_once(config),
    )
    _logger.info("%s runs on OpenVINO in %s with %d threads", file.name, config.precision, config.threads)
    return engine


def _at_once(config: PerceptionConfig) -> int:
    """Inferences that run at the same time: as many of the requests in hand as the cores allow."""
    return max(1, min(config.prefetch, available_cores() // config.threads))


def _require_installed(backend: str) -> None:
    if importlib.util.find_spec(backend) is None:
        raise Unavailable(
            f"{backend} is not installed; install it with the 'perception' extra or choose another backend"
        )
