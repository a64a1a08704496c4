"""A picture as a network takes it: its size, the order of its colours, and their scale."""

from dataclasses import dataclass
from typing import NamedTuple, cast

import cv2
import numpy as np

from protocol.arrays import Float32Array, UInt8Array
from protocol.config import Pixels


class _Scale(NamedTuple):
    """(value - mean) / divisor for each of R, G and B; `reverse` gives them as B, G, R."""

    mean: tuple[float, float, float]
    divisor: tuple[float, float, float]
    reverse: bool = False


_SCALES = {
    "bgr_centred": _Scale((128.0, 128.0, 128.0), (256.0, 256.0, 256.0), reverse=True),
    "rgb_unit": _Scale((0.0, 0.0, 0.0), (255.0, 255.0, 255.0)),
    "rgb_signed": _Scale((127.5, 127.5, 127.5), (127.5, 127.5, 127.5)),
    "rgb_imagenet": _Scale((123.675, 116.28, 103.53), (58.395, 57.12, 57.375)),
}


def as_image(rgb: UInt8Array, pixels: Pixels) -> Float32Array:
    """(3, rows, columns) of a picture (rows, columns, 3), in the colours and the scale that a network takes."""
    if pixels == "bgr":
        return np.ascontiguousarray(rgb[..., ::-1].transpose(2, 0, 1), dtype=np.float32)
    mean, divisor, reverse = _SCALES[pixels]
    scaled = (rgb.astype(np.float32) - np.array(mean, np.float32)) / np.array(divisor, np.float32)
    return np.ascontiguousarray((scaled[..., ::-1] if reverse else scaled).transpose(2, 0, 1))


def stretched(rgb: UInt8Array, size: tuple[int, int]) -> UInt8Array:
    """A picture in another size (rows, columns), whatever its shape was."""
    rows, columns = size
    shrinks = rows <= rgb.shape[0] and columns <= rgb.shape[1]
    method = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return cast("UInt8Array", cv2.resize(rgb, (columns, rows), interpolation=method))


@dataclass(frozen=True)
class Placement:
    """Where a picture lies in a larger one, in cells of the network's maps."""

    top: int
    left: int
    rows: int
    columns: int

    def cut(self, maps: Float32Array) -> Float32Array:
        """The part of maps (n, rows, columns) that shows the picture."""
        return maps[:, self.top : self.top + self.rows, self.left : self.left + self.columns]


def fitted(rgb: UInt8Array, size: tuple[int, int], stride: int) -> tuple[UInt8Array, Placement]:
    """A picture in the middle of a black one of another size (rows, columns), its shape kept.

    It covers whole cells of `stride` pixels, so its shape is kept to within half a cell.
    """
    scale = min(whole / side for whole, side in zip(size, rgb.shape[:2], strict=True))
    rows, columns = (max(round(side * scale / stride), 1) for side in rgb.shape[:2])
    top, left = (size[0] // stride - rows) // 2, (size[1] // stride - columns) // 2
    black = np.zeros((*size, 3), np.uint8)
    whole_cells = stretched(rgb, (rows * stride, columns * stride))
    black[top * stride : (top + rows) * stride, left * stride : (left + columns) * stride] = whole_cells
    return black, Placement(top, left, rows, columns)
