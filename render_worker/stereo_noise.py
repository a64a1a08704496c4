"""Depth as an Intel RealSense D435i would measure it: stereo noise in disparity, and holes where stereo fails.

Disparity is focal length times baseline over depth, so a constant error in disparity is an error in depth that grows
with the square of the distance. Constants: Intel's D400 series datasheet and its white paper on tuning depth cameras
(RMS sub-pixel error of 0.08 px, disparities in steps of 1/32 px).
"""

import hashlib
import math

import cv2
import msgspec
import numpy as np

from protocol.arrays import BoolArray, Float32Array
from protocol.camera import Camera, Intrinsics
from protocol.region import Region
from protocol.scene import Scene

BASELINE = 0.050
FOCAL = 848 / 2 / np.tan(np.radians(87.0) / 2)
"""Of the depth camera itself, whose picture is 848 pixels and 87° wide; metres and pixels."""

SUBPIXEL_ERROR = 0.08
DISPARITY_STEP = 1 / 32
NEAREST, FARTHEST = 0.28, 10.0

_EDGE = 1.0
"""Pixels of disparity that change within a matching window and leave no match."""


def noise_seed(scene: Scene, camera: Camera) -> int:
    """A seed that follows from scene and camera, so that every worker gives the same answer at any time."""
    encoded = msgspec.msgpack.encode((scene, camera))
    return int.from_bytes(hashlib.blake2b(encoded, digest_size=8).digest(), "big")


def depth_error(depth: float) -> float:
    """Standard deviation, in metres, of a depth measured at `depth` metres."""
    return depth**2 * SUBPIXEL_ERROR / (FOCAL * BASELINE)


def measure_depth(depth: Float32Array, focal: float, seed: int) -> Float32Array:
    """A D435i's measurement of a true planar depth.

    Args:
        depth: (height, width) metres, 0 where there is nothing.
        focal: of the picture, in pixels; it decides how wide the occlusion shadows are in it.
        seed: of the noise; the same arguments give the same bytes.

    Returns:
        (height, width) metres; 0 where stereo finds no match: no surface, out of range, at a depth edge, or seen by the
        left camera only.
    """
    whole = Region.whole(*depth.shape)
    return measure_part(depth, whole, whole, depth.shape, focal, seed)


def measure_part(
    depth: Float32Array, around: Region, region: Region, size: tuple[int, ...], focal: float, seed: int
) -> Float32Array:
    """A D435i's measurement in a region of a picture, to the bit that of `measure_depth` there.

    Args:
        depth: (around.height, around.width) metres, 0 where there is nothing.
        around: what the depth is of; all that `seen_around` tells.
        size: rows and columns of the whole picture.
        focal, seed: as in `measure_depth`.

    Returns:
        (region.height, region.width) metres.
    """
    seen = (depth > 0) & np.isfinite(depth)
    disparity = np.zeros_like(depth)
    np.divide(np.float32(FOCAL * BASELINE), depth, out=disparity, where=seen)
    in_picture = disparity * np.float32(focal / FOCAL)
    seen &= ~_at_edge(in_picture) & ~_in_occlusion_shadow(in_picture, around.left)
    inner = region.within(around)
    seen, disparity = inner.part(seen), inner.part(disparity)
    measured = disparity + np.float32(SUBPIXEL_ERROR) * _matching_noise(region, size, seed)
    measured = np.round(measured / np.float32(DISPARITY_STEP)) * np.float32(DISPARITY_STEP)
    noisy = np.zeros(region.shape, np.float32)
    np.divide(np.float32(FOCAL * BASELINE), measured, out=noisy, where=seen & (measured > 0))
    noisy[(noisy < NEAREST) | (noisy > FARTHEST)] = 0
    return noisy


def seen_around(region: Region, intrinsics: Intrinsics, nearest: float) -> Region:
    """The part of a picture whose depth decides what is measured in a region.

    A pixel on each side tells an edge. To the right, it is as far as the shadow of the nearest thing reaches.

    Args:
        nearest: metres; nothing in the picture is nearer.
    """
    # A pixel more than the largest disparity, whatever the rounding.
    reach = math.ceil(intrinsics.fx * BASELINE / nearest) + 1
    left, top = max(region.left - 1, 0), max(region.top - 1, 0)
    right, bottom = min(region.right + reach, intrinsics.width), min(region.bottom + 1, intrinsics.height)
    return Region(left, top, right - left, bottom - top)


def _matching_noise(region: Region, size: tuple[int, ...], seed: int) -> Float32Array:
    """Unit noise that neighbours share a part of, as matching windows overlap; a region's part of the picture's."""
    # Drawn row by row, so that rows below those that are needed need not be.
    rows, columns = min(region.bottom + 1, size[0]), size[1]
    white = np.random.default_rng(seed).standard_normal((rows, columns), dtype=np.float32)
    # The sum of nine independent values of deviation 1 has deviation 3.
    summed = cv2.boxFilter(white, -1, (3, 3), normalize=False, borderType=cv2.BORDER_REFLECT_101)
    return region.part(summed.astype(np.float32, copy=False)) / np.float32(3)


def _at_edge(disparity: Float32Array) -> BoolArray:
    window = np.ones((3, 3), np.uint8)
    return cv2.dilate(disparity, window) - cv2.erode(disparity, window) > _EDGE


def _in_occlusion_shadow(disparity: Float32Array, left: int) -> BoolArray:
    """Pixels of the left camera whose place in the right one's picture is taken by something nearer, to their right.

    Args:
        disparity: (height, width) pixels.
        left: column of the whole picture at which it begins: sums are rounded as those of the whole picture are.
    """
    columns = np.arange(left, left + disparity.shape[1], dtype=np.float32)
    in_right = columns - disparity
    nearest_taken = np.minimum.accumulate(in_right[:, ::-1], axis=1)[:, ::-1]
    shadowed = np.zeros(disparity.shape, bool)
    shadowed[:, :-1] = nearest_taken[:, 1:] < in_right[:, :-1]
    return shadowed
