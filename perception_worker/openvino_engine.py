"""A network on a CPU, run by OpenVINO."""

import threading
from pathlib import Path
from typing import Literal

import numpy as np
import openvino

from perception_worker.engine import Outputs, shapes_of
from protocol.arrays import Float32Array
from protocol.errors import InvalidConfig


class OpenVinoEngine:
    """A network compiled for one image size.

    Precision, threads and pinning are always set: left to itself OpenVINO computes in bfloat16 where the CPU can, and
    with one thread it pins every process to the same core.
    """

    def __init__(
        self,
        file: Path,
        *,
        input_size: tuple[int, int] | None,
        default_size: tuple[int, int],
        precision: Literal["f32", "bf16"],
        threads: int,
        at_once: int = 1,
    ) -> None:
        """Load and compile the network.

        Args:
            file: of the network.
            input_size: rows and columns; None for the file's own, or `default_size` where it has none.
            default_size: rows and columns.
            precision: that it computes in.
            threads: that an inference computes with.
            at_once: inferences that may run at the same time; more than that wait for each other.

        Raises:
            InvalidConfig: the file can't be read, or takes no image of this size.
        """
        core = openvino.Core()
        model, self.input_size = _read(core, file, input_size, default_size)
        self._names = [output.any_name for output in model.outputs]
        self._compiled = core.compile_model(
            model,
            "CPU",
            {
                "INFERENCE_PRECISION_HINT": precision,
                "INFERENCE_NUM_THREADS": threads * at_once,
                "ENABLE_CPU_PINNING": False,
                "NUM_STREAMS": at_once,
            },
        )
        self._local = threading.local()
        # The first look at a tensor's data initialises the binding: two threads that do so at once wait for each other
        # for ever, Python's lock held, and the process answers no ping any more.
        self.outputs = shapes_of(self.run(np.zeros((3, *self.input_size), np.float32)))

    def run(self, image: Float32Array) -> Outputs:
        """What the network gives for an image (3, rows, columns), by name and without the batch's dimension."""
        request = self._request()
        # Its own tensors: what `infer` does to take an array and to give a dictionary costs a tenth of a small network.
        request.get_input_tensor().data[0] = image
        request.start_async()
        request.wait()
        # The request's tensors are overwritten by its next inference.
        return {name: request.get_output_tensor(place).data[0].copy() for place, name in enumerate(self._names)}

    def _request(self) -> openvino.InferRequest:
        """The calling thread's own request."""
        if not hasattr(self._local, "request"):
            self._local.request = self._compiled.create_infer_request()
        return self._local.request


def _read(
    core: openvino.Core, file: Path, wanted: tuple[int, int] | None, default: tuple[int, int]
) -> tuple[openvino.Model, tuple[int, int]]:
    """The network for images of one size, and that size."""
    rows, columns = wanted or default
    try:
        model = core.read_model(file)
        if wanted is None:
            rows, columns = _own_size(model) or default
        model.reshape([1, 3, rows, columns])
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise InvalidConfig(
            f"perception.network: OpenVINO can't use {file} on images of {rows}×{columns}: {reason}"
        ) from error
    # OpenVINO would make whole numbers of pixels between 0 and 1, all 0, without a word.
    if not model.inputs[0].element_type.is_real():
        kind = model.inputs[0].element_type.get_type_name()
        raise InvalidConfig(f"perception.network: {file} takes images of {kind}, and ours are of float32")
    return model, (rows, columns)


def _own_size(model: openvino.Model) -> tuple[int, int] | None:
    """Rows and columns that a network is made for; None where it takes several, or no image at all."""
    shape = model.inputs[0].partial_shape
    if shape.rank.is_dynamic or len(shape) != 4 or shape[2].is_dynamic or shape[3].is_dynamic:
        return None
    return shape[2].get_length(), shape[3].get_length()
