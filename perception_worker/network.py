"""A pose network, whichever it is: part of a frame in, heatmaps of the 18 joints and one person's keypoints out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.errors import InvalidConfig
from protocol.skeleton import JOINT_COUNT

HEATMAP_CHANNELS = JOINT_COUNT + 1
PAF_CHANNELS = 38


@dataclass(frozen=True, eq=False)
class NetworkOutput:
    """What the network makes of one image.

    Attributes:
        heatmaps: (19, rows, columns), COCO-18 in OpenPose's order, then the background; they cover the whole image.
        pafs: (38, rows, columns), x and y components for each limb; (0, rows, columns) from a network that has none.
    """

    heatmaps: Float32Array
    pafs: Float32Array


class Network(Protocol):
    """May be called by several threads at once."""

    @property
    def input_size(self) -> tuple[int, int]:
        """Rows and columns of what it is shown; a part of a frame in this shape is neither distorted nor padded."""
        ...

    def infer(self, rgb: UInt8Array) -> NetworkOutput:
        """Run the network on an image (rows, columns, 3) of any size, RGB.

        Raises:
            InvalidConfig: it gave heatmaps that are not finite.
        """
        ...

    def decode(self, output: NetworkOutput) -> Float64Array:
        """One person's keypoints: (18, 2) column and row in cells of the heatmaps, NaN for joints not detected."""
        ...


def with_background(joints: Float32Array) -> Float32Array:
    """(19, rows, columns): the heatmaps (18, rows, columns) of a network without one of the background, and that."""
    background = np.clip(1 - joints.max(axis=0, keepdims=True), 0, 1)
    return np.concatenate([joints, background.astype(joints.dtype)])


def require_finite(heatmaps: Float32Array, name: str) -> None:
    """Refuse heatmaps that would make numbers of what is none.

    Raises:
        InvalidConfig: a value is NaN or infinite.
    """
    if not np.isfinite(heatmaps).all():
        raise InvalidConfig(
            f"perception.network: {name} gave heatmaps that are not finite; is it damaged, or made for other pixels "
            "(perception.pixels) or another precision?"
        )
