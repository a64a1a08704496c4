"""A network on whatever ONNX Runtime finds: TensorRT, then CUDA, then the CPU."""

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from perception_worker.networks.engine import Outputs, shapes_of
from perception_worker.networks.signature import (
    COLOURS,
    FLOATS,
    TensorSpec,
    as_float32,
    explained,
    image_size,
    outputs_of_floats,
)
from protocol.arrays import Float32Array
from protocol.artifact import cache_directory

TENSORRT, CUDA, CPU = "TensorrtExecutionProvider", "CUDAExecutionProvider", "CPUExecutionProvider"

_LIBRARY = "ONNX Runtime"

_KINDS = {"tensor(float)": "float32", "tensor(float16)": "float16", "tensor(double)": "float64"}
"""ONNX Runtime's names of types, and numpy's."""

_SEVERITY_ERROR = 3


class OnnxRuntimeEngine:
    """A network in float32; a session may be run by several threads at once.

    Attributes:
        provider: what runs it.
    """

    def __init__(
        self, file: Path, *, input_size: tuple[int, int] | None, default_size: tuple[int, int], threads: int
    ) -> None:
        """Load the network with the first of TensorRT, CUDA and the CPU that this machine has.

        Args:
            file: of the network.
            input_size: rows and columns; None for the file's own, or `default_size` where it has none.
            default_size: rows and columns.
            threads: that it computes with.

        Raises:
            InvalidConfig: the file can't be read or run, takes no image of this size, or gives no maps.
        """
        with explained(_LIBRARY, file, input_size or default_size):
            self._session = _session(file, _session_options(threads), _providers())
            inputs = [_spec(port) for port in self._session.get_inputs()]
            self.input_size = image_size(inputs, file, input_size, default_size)
            self._names = outputs_of_floats([_spec(port) for port in self._session.get_outputs()], file)
        self._input, self._kind = inputs[0].name, FLOATS[inputs[0].kind]
        self.provider: str = self._session.get_providers()[0]
        with explained(_LIBRARY, file, self.input_size):
            self.outputs = shapes_of(self.run(np.zeros((COLOURS, *self.input_size), dtype=np.float32)))

    def run(self, image: Float32Array) -> Outputs:
        """The network's outputs for an image (3, rows, columns), by name and without the batch's dimension."""
        given = {self._input: image[None].astype(self._kind, copy=False)}
        outputs: list[Any] = list(self._session.run(self._names, given))
        # It does not tell an output of no sides from one of any.
        return {name: as_float32(np.atleast_1d(output)[0]) for name, output in zip(self._names, outputs, strict=True)}


def _session(file: Path, options: onnxruntime.SessionOptions, providers: list[Any]) -> onnxruntime.InferenceSession:
    """With the first provider whose libraries are all here."""
    try:
        # ONNX Runtime's own second try forgets the providers' options, and so would compute in TF32.
        return onnxruntime.InferenceSession(file, options, providers=providers, enable_fallback=0)
    except (ValueError, RuntimeError):
        if len(providers) == 1:
            raise
        return _session(file, options, providers[1:])


def gpu_providers() -> list[str]:
    """The providers of a GPU that this build of ONNX Runtime has, the faster first."""
    available = onnxruntime.get_available_providers()
    return [provider for provider in (TENSORRT, CUDA) if provider in available]


def _spec(port: onnxruntime.NodeArg) -> TensorSpec:
    """An input or an output as the file declares it; ONNX Runtime gives no sides where it knows none."""
    sides = tuple(side if isinstance(side, int) else None for side in port.shape) or None
    kind = str(port.type)
    return TensorSpec(port.name, sides, _KINDS.get(kind, kind))


def _providers() -> list[str | tuple[str, dict[str, Any]]]:
    options: dict[str, dict[str, Any]] = {
        # Building an engine takes minutes; a worker that starts again finds the last one.
        TENSORRT: {"trt_engine_cache_enable": True, "trt_engine_cache_path": str(cache_directory() / "tensorrt")},
        # TF32 would round the inputs of every product to 10 bits, and the heatmaps would change.
        CUDA: {"use_tf32": False},
    }
    return [*((provider, options[provider]) for provider in gpu_providers()), CPU]


def _session_options(threads: int) -> onnxruntime.SessionOptions:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = _SEVERITY_ERROR
    # Threads that spin while they wait take the core that another process renders on.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return options
