"""A pose network of OpenPose's kind, whatever runs it.

It takes the picture as float32 BGR from 0 to 255, not normalised, and gives a heatmap for each of the 18 joints and the
background, and a two-component part-affinity field for each of 19 limbs.
"""

from dataclasses import dataclass
from typing import Protocol

from protocol.arrays import Float32Array

HEATMAP_CHANNELS = 19
PAF_CHANNELS = 38
STRIDE = 8
"""Pixels of the network's input to one cell of its maps, each way."""


@dataclass(frozen=True, eq=False)
class NetworkOutput:
    """What the network makes of one image.

    Attributes:
        heatmaps: (19, rows, columns), COCO-18 in OpenPose's order, then the background.
        pafs: (38, rows, columns), x and y components for each limb.
    """

    heatmaps: Float32Array
    pafs: Float32Array


class Network(Protocol):
    """Runs on images of one size; may be called by several threads at once."""

    @property
    def input_size(self) -> tuple[int, int]:
        """Rows and columns of the image that it takes."""
        ...

    def infer(self, image: Float32Array) -> NetworkOutput:
        """Run the network on an image (3, rows, columns), BGR from 0 to 255."""
        ...
