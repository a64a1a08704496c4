"""A pose network: part of a frame in, heatmaps of the 18 joints and one person's keypoints out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.errors import InvalidOutput
from protocol.skeleton import JOINT_COUNT

HEATMAP_CHANNELS = JOINT_COUNT + 1
PAF_CHANNELS = 38


@dataclass(frozen=True, eq=False)
class NetworkOutput:
    """A network's output for one image.

    Attributes:
        heatmaps: (19, rows, columns), COCO-18 in OpenPose's order, then the background; they cover the whole image.
        pafs: (38, rows, columns), x and y components for each limb; (0, rows, columns) from a network that has none.
    """

    heatmaps: Float32Array
    pafs: Float32Array

    @property
    def map_size(self) -> tuple[int, int]:
        """Rows and columns of a heatmap."""
        _, rows, columns = self.heatmaps.shape
        return rows, columns


@dataclass(frozen=True, eq=False)
class People:
    """The people that a network detected, in cells of the heatmaps: column and row, NaN for joints not detected.

    Attributes:
        person: (18, 2) of the frame's main person; all NaN where there is none.
        others: (n, 18, 2) of other people, where the network tells people apart.
    """

    person: Float64Array
    others: Float64Array


class Network(Protocol):
    """May be called by several threads at once."""

    @property
    def input_size(self) -> tuple[int, int]:
        """Rows and columns of its input; a part of a frame in this shape is neither distorted nor padded."""
        ...

    def infer(self, rgb: UInt8Array) -> NetworkOutput:
        """Run the network on an image (rows, columns, 3) of any size, RGB.

        Raises:
            InvalidOutput: it gave maps that are empty or not finite.
        """
        ...

    def decode(self, output: NetworkOutput) -> People:
        """The keypoints of the frame's main person, and of the others."""
        ...


def with_background(joints: Float32Array) -> Float32Array:
    """(19, rows, columns): the heatmaps (18, rows, columns) of a network without a background, and a background."""
    background = np.clip(1 - joints.max(axis=0, keepdims=True), 0, 1)
    return np.concatenate([joints, background.astype(joints.dtype)])


def require_finite(maps: Float32Array, network: str, what: str = "heatmaps") -> None:
    """Refuse maps that are empty or not finite.

    Raises:
        InvalidOutput: a value is NaN or infinite, or the maps are empty.
    """
    if maps.size == 0:
        raise InvalidOutput(f"perception.network: {network} gave {what} that are empty: their shape is {maps.shape}")
    if not np.isfinite(maps).all():
        raise InvalidOutput(
            f"perception.network: {network} gave {what} that are not finite; is it damaged, or made for other pixels "
            "(perception.pixels) or another precision?"
        )
