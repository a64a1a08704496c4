"""A network on a CPU, run by OpenVINO."""

import threading
from pathlib import Path
from typing import Literal

import numpy as np
import openvino

from perception_worker.networks.engine import Outputs, shapes_of
from perception_worker.networks.signature import COLOURS, TensorSpec, explained, image_size, outputs_of_floats
from protocol.arrays import Float32Array

_KINDS = {"f32": "float32", "f16": "float16", "f64": "float64"}
"""OpenVINO's names of types, and numpy's."""


class OpenVinoEngine:
    """A network compiled for one image size.

    Precision, threads and pinning are always set: by default OpenVINO computes in bfloat16 where the CPU can, and with
    one thread it pins every process to the same core.
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
            InvalidConfig: the file can't be read or run, takes no image of this size, or gives no maps.
        """
        with explained("OpenVINO", file, input_size or default_size):
            core = openvino.Core()
            model = core.read_model(file)
            self.input_size = image_size([_spec(port) for port in model.inputs], file, input_size, default_size)
        with explained("OpenVINO", file, self.input_size):
            model.reshape([1, COLOURS, *self.input_size])
            given = [_spec(port) for port in model.outputs]
            names = outputs_of_floats(given, file)
            self._places = {spec.name: place for place, spec in enumerate(given) if spec.name in names}
            settings = {
                "INFERENCE_PRECISION_HINT": precision,
                "INFERENCE_NUM_THREADS": threads * at_once,
                "ENABLE_CPU_PINNING": False,
                "NUM_STREAMS": at_once,
            }
            self._compiled = core.compile_model(model, "CPU", settings)
            self._local = threading.local()
            # The first access to a tensor's data initialises the binding: two threads that do so at once deadlock with
            # Python's lock held, and the process answers no more pings.
            self.outputs = shapes_of(self.run(np.zeros((COLOURS, *self.input_size), np.float32)))

    def run(self, image: Float32Array) -> Outputs:
        """The network's outputs for an image (3, rows, columns), by name and without the batch's dimension."""
        request = self._request()
        # Its own tensors: what `infer` does to take an array and to give a dictionary costs a tenth of a small network.
        request.get_input_tensor().data[0] = image
        request.start_async()
        request.wait()
        # The request's tensors are overwritten by its next inference.
        return {
            name: np.array(request.get_output_tensor(place).data[0], np.float32) for name, place in self._places.items()
        }

    def _request(self) -> openvino.InferRequest:
        """The calling thread's own request."""
        if not hasattr(self._local, "request"):
            self._local.request = self._compiled.create_infer_request()
        return self._local.request


def _spec(port: openvino.Output) -> TensorSpec:
    """An input or an output as the network's file describes it."""
    shape, kind = port.partial_shape, port.element_type.get_type_name()
    sides = None if shape.rank.is_dynamic else tuple(None if one.is_dynamic else one.get_length() for one in shape)
    return TensorSpec(port.any_name, sides, _KINDS.get(kind, kind))
