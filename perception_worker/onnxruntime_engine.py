"""A network on whatever ONNX Runtime finds: TensorRT, then CUDA, then the CPU."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from perception_worker.engine import Outputs, shapes_of
from protocol.arrays import Float32Array
from protocol.artifact import cache_directory
from protocol.errors import InvalidConfig

TENSORRT, CUDA, CPU = "TensorrtExecutionProvider", "CUDAExecutionProvider", "CPUExecutionProvider"

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
            InvalidConfig: the file can't be read, or takes no image of this size.
        """
        with _explained(file, input_size or default_size):
            self._session = _session(file, _session_options(threads), _providers())
        self._names = [output.name for output in self._session.get_outputs()]
        image = self._session.get_inputs()[0]
        self._input = image.name
        self.provider: str = self._session.get_providers()[0]
        self.input_size = input_size or _own_size(image.shape) or default_size
        with _explained(file, self.input_size):
            self.outputs = shapes_of(self.run(np.zeros((3, *self.input_size), dtype=np.float32)))

    def run(self, image: Float32Array) -> Outputs:
        """What the network gives for an image (3, rows, columns), by name and without the batch's dimension."""
        outputs: list[Any] = list(self._session.run(self._names, {self._input: image[None]}))
        return {name: output[0] for name, output in zip(self._names, outputs, strict=True)}


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


def _own_size(shape: Sequence[object]) -> tuple[int, int] | None:
    """Rows and columns that a network is made for; None where it takes several, or no image at all."""
    if len(shape) != 4 or not isinstance(shape[2], int) or not isinstance(shape[3], int):
        return None
    return shape[2], shape[3]


@contextmanager
def _explained(file: Path, input_size: tuple[int, int]) -> Generator[None]:
    try:
        yield
    except Exception as error:  # ONNX Runtime's exceptions have no root of their own.
        rows, columns = input_size
        raise InvalidConfig(
            f"perception.network: ONNX Runtime can't use {file} on images of {rows}×{columns}: {error}"
        ) from error


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
