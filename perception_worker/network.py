"""A pose network of OpenPose's kind, whatever runs it.

It takes the picture as float32 BGR from 0 to 255, not normalised, and gives a heatmap for each of the 18 joints and the
background, and a two-component part-affinity field for each of 19 limbs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from protocol.arrays import Float32Array
from protocol.errors import InvalidConfig

HEATMAP_CHANNELS = 19
PAF_CHANNELS = 38


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


def pose_outputs(outputs: Mapping[str, Sequence[object]], file: Path) -> tuple[str, str]:
    """The names of the heatmaps and the part-affinity fields among a network's outputs, told by their channels.

    Args:
        outputs: each output's shape; a dimension that is not fixed may be anything but a number.
        file: where the network comes from.

    Raises:
        InvalidConfig: the network has other outputs; the message lists them.
    """
    by_channels = {shape[1]: name for name, shape in outputs.items() if len(shape) == 4}
    if {HEATMAP_CHANNELS, PAF_CHANNELS} <= by_channels.keys():
        return by_channels[HEATMAP_CHANNELS], by_channels[PAF_CHANNELS]
    found = ", ".join(f"{name} [{', '.join(map(str, shape))}]" for name, shape in outputs.items())
    raise InvalidConfig(
        f"perception.network: {file} gives {found}; a pose network gives heatmaps [n, {HEATMAP_CHANNELS}, h, w] "
        f"and part-affinity fields [n, {PAF_CHANNELS}, h, w]"
    )
