"""The engines that the pose network is tried on, by name."""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from perception_worker.backend import DEFAULT_SIZE, input_size, peak_threshold, region_size
from perception_worker.engine import Engine, Outputs, shapes_of
from perception_worker.layout import find_layout
from perception_worker.look import Look, TrackingLook, WholeLook
from perception_worker.models import OPENPOSE_MOBILENET_THIN, require_network
from perception_worker.openpose_network import OpenPoseNetwork
from protocol.arrays import Float32Array
from protocol.config import PerceptionConfig
from protocol.errors import Unavailable


class Opened(NamedTuple):
    """A way of looking with its networks, what runs them, and whether that is a GPU."""

    look: Look
    device: str
    on_gpu: bool


def open_on(name: str, config: PerceptionConfig) -> Opened:
    """The default network on an engine of `ENGINES`, looking as a settled configuration says.

    Raises:
        VantageError: this machine can't run that.
    """
    whole = _open_network(name, input_size(config) or DEFAULT_SIZE, config)
    if config.look == "whole":
        return Opened(WholeLook(whole.network), whole.device, whole.on_gpu)
    closer = _open_network(name, region_size(config) or DEFAULT_SIZE, config)
    return Opened(TrackingLook(whole.network, closer.network), whole.device, whole.on_gpu)


class _OpenedNetwork(NamedTuple):
    network: OpenPoseNetwork
    device: str
    on_gpu: bool


def _open_network(name: str, size: tuple[int, int], config: PerceptionConfig) -> _OpenedNetwork:
    file = require_network(OPENPOSE_MOBILENET_THIN)
    engine, device, on_gpu = ENGINES[name](file, size)
    layout = find_layout(engine.outputs, file)
    network = OpenPoseNetwork(engine, layout, pixels="bgr", threshold=peak_threshold(config), name=name)
    return _OpenedNetwork(network, device, on_gpu)


def cpu_engine() -> str:
    """What a perception worker would take without a GPU, or the next best."""
    return "openvino" if importlib.util.find_spec("openvino") else "onnxruntime"


_Size = tuple[int, int]
_Found = tuple[Engine, str, bool]


def _openvino(file: Path, size: _Size) -> _Found:
    if not importlib.util.find_spec("openvino"):
        raise Unavailable("OpenVINO is not installed")
    from perception_worker.openvino_engine import OpenVinoEngine

    engine = OpenVinoEngine(file, input_size=size, default_size=size, precision="f32", threads=1)
    return engine, "OpenVINO, 1 thread", False


def _onnxruntime(file: Path, size: _Size) -> _Found:
    """As a perception worker opens it: with whatever there is."""
    if not importlib.util.find_spec("onnxruntime"):
        raise Unavailable("ONNX Runtime is not installed")
    from perception_worker.onnxruntime_engine import CPU, OnnxRuntimeEngine

    engine = OnnxRuntimeEngine(file, input_size=size, default_size=size, threads=1)
    return engine, f"ONNX Runtime, {_short(engine.provider)}", engine.provider != CPU


def _onnxruntime_cuda(**options: Any) -> Callable[[Path, _Size], _Found]:
    """CUDA's provider with options that a perception worker does not set."""

    def opened(file: Path, size: _Size) -> _Found:
        if not importlib.util.find_spec("onnxruntime"):
            raise Unavailable("ONNX Runtime is not installed")
        from perception_worker.onnxruntime_engine import CUDA

        engine = _Session(file, size, CUDA, {"use_tf32": False} | options)
        if engine.provider != CUDA:
            raise Unavailable("ONNX Runtime can't use CUDA here")
        said = ", ".join(f"{name}={value}" for name, value in options.items())
        return engine, f"ONNX Runtime, CUDA, {said}", True

    return opened


class _Session:
    """A session of ONNX Runtime's, with the provider's options as they are given."""

    def __init__(self, file: Path, size: _Size, provider: str, options: dict[str, Any]) -> None:
        import numpy as np
        import onnxruntime

        self._session = onnxruntime.InferenceSession(file, providers=[(provider, options), "CPUExecutionProvider"])
        self._names = [output.name for output in self._session.get_outputs()]
        self._input = self._session.get_inputs()[0].name
        self.provider: str = self._session.get_providers()[0]
        self.input_size = size
        self.outputs = shapes_of(self.run(np.zeros((3, *size), np.float32)))

    def run(self, image: Float32Array) -> Outputs:
        outputs: list[Any] = list(self._session.run(self._names, {self._input: image[None]}))
        return {name: output[0] for name, output in zip(self._names, outputs, strict=True)}


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
    # Searching for the quickest algorithm, as is the default, may find another one each time.
    "onnxruntime-heuristic": _onnxruntime_cuda(cudnn_conv_algo_search="HEURISTIC"),
    "onnxruntime-default": _onnxruntime_cuda(cudnn_conv_algo_search="DEFAULT"),
    "torch": _torch,
}
