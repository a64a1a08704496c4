"""The engines that the pose network is tried on, by name."""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from perception_worker.detection import Detector, TrackingDetector, WholeFrameDetector
from perception_worker.detection.choice import quick_search_size
from perception_worker.networks.backend import (
    DEFAULT_SIZE,
    input_size,
    network_name,
    peak_threshold,
    region_size,
)
from perception_worker.networks.engine import Engine
from perception_worker.networks.layout import find_layout
from perception_worker.networks.models import KNOWN, require_network
from perception_worker.networks.openpose_network import OpenPoseNetwork
from protocol.config import PerceptionConfig
from protocol.errors import Unavailable


class Opened(NamedTuple):
    """A detector with its networks, the device that runs them, and whether that is a GPU."""

    detector: Detector
    device: str
    on_gpu: bool


def open_on(name: str, config: PerceptionConfig) -> Opened:
    """The detector of a settled configuration, with the default network on an engine of `ENGINES`.

    Raises:
        VantageError: this machine can't run that.
    """
    whole = _open_network(name, input_size(config) or DEFAULT_SIZE, config)
    if config.look == "whole":
        return Opened(WholeFrameDetector(whole.network), whole.device, whole.on_gpu)
    closer = _open_network(name, region_size(config) or DEFAULT_SIZE, config)
    quick = quick_search_size(config)
    searching = [_open_network(name, quick, config).network] if quick else []
    return Opened(TrackingDetector([*searching, whole.network], closer.network), whole.device, whole.on_gpu)


class _OpenedNetwork(NamedTuple):
    network: OpenPoseNetwork
    device: str
    on_gpu: bool


def _open_network(name: str, size: tuple[int, int], config: PerceptionConfig) -> _OpenedNetwork:
    file = require_network(KNOWN[network_name(config)])
    engine, device, on_gpu = ENGINES[name](file, size)
    layout = find_layout(engine.outputs, file)
    network = OpenPoseNetwork(engine, layout, pixels="bgr", threshold=peak_threshold(config), name=name)
    return _OpenedNetwork(network, device, on_gpu)


def cpu_engine() -> str:
    """The engine that a perception worker takes without a GPU, or the next best."""
    return "openvino" if importlib.util.find_spec("openvino") else "onnxruntime"


_Size = tuple[int, int]
_Found = tuple[Engine, str, bool]


def _openvino(file: Path, size: _Size) -> _Found:
    if not importlib.util.find_spec("openvino"):
        raise Unavailable("OpenVINO is not installed")
    from perception_worker.networks.openvino_engine import OpenVinoEngine

    engine = OpenVinoEngine(file, input_size=size, default_size=size, precision="f32", threads=1)
    return engine, "OpenVINO, 1 thread", False


def _onnxruntime(file: Path, size: _Size) -> _Found:
    """As a perception worker opens it: with whatever there is."""
    if not importlib.util.find_spec("onnxruntime"):
        raise Unavailable("ONNX Runtime is not installed")
    from perception_worker.networks.onnxruntime_engine import CPU, OnnxRuntimeEngine

    engine = OnnxRuntimeEngine(file, input_size=size, default_size=size, threads=1)
    return engine, f"ONNX Runtime, {_short(engine.provider)}", engine.provider != CPU


def _torch(file: Path, size: _Size) -> _Found:
    if not importlib.util.find_spec("torch"):
        raise Unavailable("PyTorch is not installed")
    import torch

    from benchmarks.accelerator.torch_engine import TorchEngine

    on_gpu = torch.cuda.is_available()
    engine = TorchEngine(file, input_size=size, device="cuda" if on_gpu else "cpu")
    return engine, f"PyTorch, {engine.device}", on_gpu


def _short(provider: str) -> str:
    return provider.removesuffix("ExecutionProvider")


ENGINES: dict[str, Callable[[Path, _Size], _Found]] = {
    "openvino": _openvino,
    "onnxruntime": _onnxruntime,
    "torch": _torch,
}
