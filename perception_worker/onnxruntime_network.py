"""The pose network on whatever ONNX Runtime finds: TensorRT, then CUDA, then the CPU."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from perception_worker.network import NetworkOutput, pose_outputs
from protocol.arrays import Float32Array
from protocol.artifact import cache_directory
from protocol.errors import InvalidConfig

TENSORRT, CUDA, CPU = "TensorrtExecutionProvider", "CUDAExecutionProvider", "CPUExecutionProvider"

_SEVERITY_ERROR = 3


class OnnxRuntimeNetwork:
    """A network in float32; a session may be run by several threads at once.

    Attributes:
        provider: what runs it.
    """

    def __init__(self, file: Path, *, input_size: tuple[int, int], threads: int) -> None:
        """Load the network with the first of TensorRT, CUDA and the CPU that this machine has.

        Raises:
            InvalidConfig: the file can't be read, takes no image of this size or has other outputs.
        """
        self.input_size = input_size
        with _explained(file, input_size):
            self._session = onnxruntime.InferenceSession(file, _session_options(threads), providers=_providers())
        shapes = {output.name: output.shape for output in self._session.get_outputs()}
        self._outputs = pose_outputs(shapes, file)
        self._input = self._session.get_inputs()[0].name
        self.provider: str = self._session.get_providers()[0]
        with _explained(file, input_size):
            self.infer(np.zeros((3, *input_size), dtype=np.float32))

    def infer(self, image: Float32Array) -> NetworkOutput:
        """Run the network on an image (3, rows, columns), BGR from 0 to 255."""
        outputs: list[Any] = list(self._session.run(self._outputs, {self._input: image[None]}))
        return NetworkOutput(heatmaps=outputs[0][0], pafs=outputs[1][0])


def gpu_providers() -> list[str]:
    """The providers of a GPU that this build of ONNX Runtime has, the faster first."""
    available = onnxruntime.get_available_providers()
    return [provider for provider in (TENSORRT, CUDA) if provider in available]


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
