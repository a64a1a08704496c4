"""A network of OpenPose's kind: heatmaps and part-affinity fields of all people in the picture, grouped into people."""

from perception_worker.networks.decoding import decode
from perception_worker.networks.engine import Engine
from perception_worker.networks.layout import FoundLayout
from perception_worker.networks.network import NetworkOutput, People, require_finite
from perception_worker.networks.pixels import as_image, stretched
from protocol.arrays import UInt8Array
from protocol.config import Pixels


class OpenPoseNetwork:
    """Sees a picture stretched to its size, and finds the person who shows the most joints.

    Args:
        threshold: height that a peak must exceed.
        name: for messages.
    """

    def __init__(self, engine: Engine, layout: FoundLayout, *, pixels: Pixels, threshold: float, name: str) -> None:
        self.input_size = engine.input_size
        self._engine = engine
        self._layout = layout
        self._pixels: Pixels = pixels
        self._threshold = threshold
        self._name = name

    def infer(self, rgb: UInt8Array) -> NetworkOutput:
        """Run the network on an image (rows, columns, 3) of any size, RGB.

        Raises:
            InvalidOutput: it gave maps that are empty or not finite.
        """
        image = as_image(stretched(rgb, self.input_size), self._pixels)
        output = self._layout.arranged(self._engine.run(image))
        require_finite(output.heatmaps, self._name)
        require_finite(output.pafs, self._name, "part-affinity fields")
        return output

    def decode(self, output: NetworkOutput) -> People:
        """The person with the most joints, and the others."""
        return decode(output, self._threshold)
