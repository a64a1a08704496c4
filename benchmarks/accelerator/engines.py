"""The engines that the pose network is tried on, by name."""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from perception_worker.backend import DEFAULT_SIZE, peak_threshold
from perception_worker.engine import Engine, Outputs, shapes_of
from perception_worker.layout import find_layout
from perception_worker.models import OPENPOSE_MOBILENET_THIN, require_network
from perception_worker.network import Network
from perception_worker.openpose_network import OpenPoseNetwork
from protocol.arrays import Float32Array
from protocol.config import PerceptionConfig
from protocol.errors import Unavailable


class Opened(NamedTuple):
    """A network, on what, and whether that is a GPU."""

    network: Network
    device: str
    on_gpu: bool


def open_on(name: str) -> Opened:
    """The default network on an engine of `ENGINES`.

    Raises:
        VantageError: this machine can't run that.
    """
    file = require_network(OPENPOSE_MOBILENET_THIN)
    engine, device, on_gpu = ENGINES[name](file)
    layout = find_layout(engine.outputs, file)
    threshold = peak_threshold(PerceptionConfig())
    return Opened(OpenPoseNetwork(engine, layout, pixels="bgr", threshold=threshold, name=name), device, on_gpu)


def cpu_engine() -> str:
    """What a perception worker would take without a GPU, or the next best."""
    return "openvino" if importlib.util.find_spec("openvino") else "onnxruntime"


_Found = tuple[Engine, str, bool]


def _openvino(file: Path) -> _Found:
    if not importlib.util.find_spec("openvino"):
        raise Unavailable("OpenVINO is not installed")
    from perception_worker.openvino_engine import OpenVinoEngine

    engine = OpenVinoEngine(file, input_size=DEFAULT_SIZE, default_size=DEFAULT_SIZE, precision="f32", threads=1)
    return engine, "OpenVINO, 1 thread", False


def _onnxruntime(file: Path) -> _Found:
    """As a perception worker opens it: with whatever there is."""
    if not importlib.util.find_spec("onnxruntime"):
        raise Unavailable("ONNX Runtime is not installed")
    from perception_worker.onnxruntime_engine import CPU, OnnxRuntimeEngine

    engine = OnnxRuntimeEngine(file, input_size=DEFAULT_SIZE, default_size=DEFAULT_SIZE, threads=1)
    return engine, f"ONNX Runtime, {_short(engine.provider)}", engine.provider != CPU


def _onnxruntime_cuda(**options: Any) -> Callable[[Path], _Found]:
    """CUDA's provider with options that a perception worker does not set."""

    def opened(file: Path) -> _Found:
        if not importlib.util.find_spec("onnxruntime"):
            raise Unavailable("ONNX Runtime is not installed")
        from perception_worker.onnxruntime_engine import CUDA

        engine = _Session(file, CUDA, {"use_tf32": False} | options)
        if engine.provider != CUDA:
            raise Unavailable("ONNX Runtime can't use CUDA here")
        said = ", ".join(f"{name}={value}" for name, value in options.items())
        return engine, f"ONNX Runtime, CUDA, {said}", True

    return opened


class _Session:
    """A session of ONNX Runtime's, with the provider's options as they are given."""

    def __init__(self, file: Path, provider: str, options: dict[str, Any]) -> None:
        import numpy as np
        import onnxruntime

        self._session = onnxruntime.InferenceSession(file, providers=[(provider, options), "CPUExecutionProvider"])
        self._names = [output.name for output in self._session.get_outputs()]
        self._input = self._session.get_inputs()[0].name
        self.provider: str = self._session.get_providers()[0]
        self.input_size = DEFAULT_SIZE
        self.outputs = shapes_of(self.run(np.zeros((3, *DEFAULT_SIZE), np.float32)))

    def run(self, image: Float32Array) -> Outputs:
        outputs: list[Any] = list(self._session.run(self._names, {self._input: image[None]}))
        return {name: output[0] for name, output in zip(self._names, outputs, strict=True)}


def _torch(file: Path) -> _Found:
    if not importlib.util.find_spec("torch"):
        raise Unavailable("PyTorch is not installed")
    import torch

    from benchmarks.accelerator.torch_engine import TorchEngine

    on_gpu = torch.cuda.is_available()
    engine = TorchEngine(file, input_size=DEFAULT_SIZE, device="cuda" if on_gpu else "cpu")
    return engine, f"PyTorch, {engine.device}", on_gpu


def _short(provider: str) -> str:
    return provider.removesuffix("ExecutionProvider")


ENGINES: dict[str, Callable[[Path], _Found]] = {
    "openvino": _openvino,
    "onnxruntime": _onnxruntime,
    # Searching for the quickest algorithm, as is the default, may find another one each time.
    "onnxruntime-heuristic": _onnxruntime_cuda(cudnn_conv_algo_search="HEURISTIC"),
    "onnxruntime-default": _onnxruntime_cuda(cudnn_conv_algo_search="DEFAULT"),
    "torch": _torch,
}
