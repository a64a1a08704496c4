"""Which library runs the pose network on this machine."""

import importlib.util
import logging
from pathlib import Path

from perception_worker.models import require_network
from perception_worker.network import Network
from protocol.config import PerceptionConfig
from protocol.errors import InvalidConfig, Unavailable

_logger = logging.getLogger(__name__)


def open_network(config: PerceptionConfig) -> Network:
    """Load the network that the configuration names, on the backend that it names.

    `auto` is ONNX Runtime where it can use a GPU, and OpenVINO elsewhere.

    Raises:
        ArtifactMissing: the default network was not pulled yet.
        ArtifactDamaged: the default network's checksum is wrong.
        InvalidConfig: another network's file is missing, can't be read or has other outputs; or the backend has no such
            precision.
        Unavailable: the backend is not installed.
    """
    file = _network_file(config)
    if config.backend == "openvino":
        return _open_openvino(file, config)
    if config.backend == "onnxruntime":
        return _open_onnxruntime(file, config)
    return _open_on_gpu(file, config) or _open_openvino(file, config)


def _network_file(config: PerceptionConfig) -> Path:
    if config.network is None:
        return require_network()
    file = Path(config.network)
    if not file.is_file():
        raise InvalidConfig(f"perception.network: there is no file {file}")
    return file


def _open_on_gpu(file: Path, config: PerceptionConfig) -> Network | None:
    """The network on a GPU, if there is one that ONNX Runtime can really use: it may be built for it and find none."""
    if config.precision != "f32" or importlib.util.find_spec("onnxruntime") is None:
        return None
    from perception_worker.onnxruntime_network import CPU, OnnxRuntimeNetwork, gpu_providers

    if not gpu_providers():
        return None
    network = OnnxRuntimeNetwork(file, input_size=(config.rows, config.columns), threads=config.threads)
    if network.provider == CPU:
        return None
    _logger.info("%s runs on ONNX Runtime's %s", file.name, network.provider)
    return network


def _open_onnxruntime(file: Path, config: PerceptionConfig) -> Network:
    if config.precision != "f32":
        raise InvalidConfig(f"perception.precision: {config.precision} is OpenVINO's; ONNX Runtime computes in f32")
    _require_installed("onnxruntime")
    from perception_worker.onnxruntime_network import OnnxRuntimeNetwork

    network = OnnxRuntimeNetwork(file, input_size=(config.rows, config.columns), threads=config.threads)
    _logger.info("%s runs on ONNX Runtime's %s", file.name, network.provider)
    return network


def _open_openvino(file: Path, config: PerceptionConfig) -> Network:
    _require_installed("openvino")
    from perception_worker.openvino_network import OpenVinoNetwork

    network = OpenVinoNetwork(
        file, input_size=(config.rows, config.columns), precision=config.precision, threads=config.threads
    )
    _logger.info("%s runs on OpenVINO in %s with %d threads", file.name, config.precision, config.threads)
    return network


def _require_installed(backend: str) -> None:
    if importlib.util.find_spec(backend) is None:
        raise Unavailable(
            f"{backend} is not installed; install it with the 'perception' extra or choose another backend"
        )
