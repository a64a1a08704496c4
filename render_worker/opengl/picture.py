"""A picture in OpenGL: how a camera's view is put onto it, and how colours and depth are read back."""

from typing import TYPE_CHECKING

import cv2
import numpy as np

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.camera import Intrinsics
from protocol.region import Region

if TYPE_CHECKING:
    from moderngl import Framebuffer

NEAREST, FARTHEST = 0.1, 100.0
"""Metres between which anything is drawn."""


def clip_projection(intrinsics: Intrinsics) -> Float64Array:
    """(4, 4) camera coordinates to OpenGL's clip space, the image's first row at the bottom, where reading starts."""
    width, height = intrinsics.width, intrinsics.height
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2 * intrinsics.fx / width, (2 * intrinsics.cx + 1) / width - 1
    matrix[1, 1], matrix[1, 2] = 2 * intrinsics.fy / height, (2 * intrinsics.cy + 1) / height - 1
    matrix[2, 2] = (FARTHEST + NEAREST) / (FARTHEST - NEAREST)
    matrix[2, 3] = -2 * FARTHEST * NEAREST / (FARTHEST - NEAREST)
    matrix[3, 2] = 1
    return matrix


def uniform(matrix: Float64Array) -> bytes:
    """A matrix as a shader takes it."""
    return matrix.T.astype(np.float32).tobytes()


def read_colours(target: "Framebuffer", region: Region) -> UInt8Array:
    """(height, width, 3) of a region."""
    pixels = np.frombuffer(target.read(viewport=rectangle(region), components=4, alignment=1), np.uint8)
    return cv2.cvtColor(pixels.reshape(*region.shape, 4), cv2.COLOR_RGBA2RGB).astype(np.uint8, copy=False)


def read_depth(target: "Framebuffer", region: Region) -> Float32Array:
    """(height, width) of a region, metres along the view; 0 where there is nothing but sky."""
    stored = target.read(viewport=rectangle(region), attachment=-1, components=1, dtype="f4", alignment=1)
    return _metres(np.frombuffer(stored, np.float32).reshape(region.shape))


def rectangle(region: Region) -> tuple[int, int, int, int]:
    """A region as OpenGL takes viewports and scissors; the picture's first row is the lowest."""
    return region.left, region.top, region.width, region.height


def _metres(stored: Float32Array) -> Float32Array:
    """Metres of the depth buffer's values, 0 to 1."""
    depth = stored * np.float32((FARTHEST - NEAREST) / (FARTHEST * NEAREST))
    np.subtract(np.float32(1 / NEAREST), depth, out=depth)
    np.reciprocal(depth, out=depth)
    depth *= stored < 1
    return depth
