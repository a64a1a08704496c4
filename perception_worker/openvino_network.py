"""The pose network on a CPU, run by OpenVINO."""

import threading
from pathlib import Path
from typing import Literal

import numpy as np
import openvino

from perception_worker.network import NetworkOutput, pose_outputs
from protocol.arrays import Float32Array
from protocol.errors import InvalidConfig


class OpenVinoNetwork:
    """A network compiled for one image size.

    Precision, threads and pinning are always set: left to itself OpenVINO computes in bfloat16 where the CPU can, and
    with one thread it pins every process to the same core.
    """

    def __init__(
        self, file: Path, *, input_size: tuple[int, int], precision: Literal["f32", "bf16"], threads: int
    ) -> None:
        """Load and compile the network.

        Raises:
            InvalidConfig: the file can't be read, takes no image of this size or has other outputs.
        """
        self.input_size = input_size
        core = openvino.Core()
        try:
            model = core.read_model(file)
            model.reshape([1, 3, *input_size])
        except RuntimeError as error:
            rows, columns = input_size
            reason = str(error).strip().splitlines()[-1]
            raise InvalidConfig(
                f"perception.network: OpenVINO can't use {file} on images of {rows}×{columns}: {reason}"
            ) from error
        shapes = {output.any_name: list(output.shape) for output in model.outputs}
        self._heatmaps, self._pafs = pose_outputs(shapes, file)
        self._compiled = core.compile_model(
            model,
            "CPU",
            {
                "INFERENCE_PRECISION_HINT": precision,
                "INFERENCE_NUM_THREADS": threads,
                "ENABLE_CPU_PINNING": False,
                "NUM_STREAMS": 1,
            },
        )
        self._local = threading.local()
        # The first look at a tensor's data initialises the binding: two threads that do so at once wait for each other
        # for ever, Python's lock held, and the process answers no ping any more.
        self.infer(np.zeros((3, *input_size), np.float32))

    def infer(self, image: Float32Array) -> NetworkOutput:
        """Run the network on an image (3, rows, columns), BGR from 0 to 255."""
        request = self._request()
        request.infer([image[None]])
        # The request's tensors are overwritten by its next inference.
        return NetworkOutput(
            heatmaps=request.get_tensor(self._heatmaps).data[0].copy(),
            pafs=request.get_tensor(self._pafs).data[0].copy(),
        )

    def _request(self) -> openvino.InferRequest:
        """The calling thread's own request."""
        if not hasattr(self._local, "request"):
            self._local.request = self._compiled.create_infer_request()
        return self._local.request
