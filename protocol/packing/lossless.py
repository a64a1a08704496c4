"""Packs colours and depth without loss; needs zstandard.

Zstandard finds repetitions. To create some in a picture, its colours are first turned into differences: red and blue
from green, and each from its left neighbour. Depth has enough repetitions (docs/decisions/0005).
"""

from typing import Any

import numpy as np
import zstandard

from protocol.arrays import AnyArray, Float32Array, UInt8Array
from protocol.errors import MalformedMessage

_LEVEL = 1
"""Of zstandard; higher levels take longer and do not compress these better."""

_DEPTH = np.dtype("<f4")


def compress_colours(rgb: UInt8Array) -> UInt8Array:
    """(height, width, 3) to bytes."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    # Differences wrap around at 256, and so do the sums that undo them.
    planes = np.stack((green, red - green, blue - green))
    planes[:, :, 1:] -= planes[:, :, :-1].copy()
    return _compress(planes)


def decompress_colours(data: UInt8Array, height: int, width: int) -> UInt8Array:
    """(height, width, 3) from bytes; `MalformedMessage` unless they are exactly such a picture."""
    differences = _decompress(data, np.dtype(np.uint8), (3, height, width), "colours")
    green, red, blue = np.cumsum(differences, axis=2, dtype=np.uint8)
    rgb = np.empty((height, width, 3), np.uint8)
    rgb[..., 1] = green
    np.add(red, green, out=rgb[..., 0])
    np.add(blue, green, out=rgb[..., 2])
    return rgb


def compress_depth(depth: Float32Array) -> UInt8Array:
    """(height, width) to bytes."""
    return _compress(depth.astype(_DEPTH, copy=False))


def decompress_depth(data: UInt8Array, height: int, width: int) -> Float32Array:
    """(height, width) from bytes; `MalformedMessage` unless they are exactly such a depth."""
    return _decompress(data, _DEPTH, (height, width), "depth").astype(np.float32, copy=False)


def _compress(array: AnyArray) -> UInt8Array:
    # With a checksum, so that what was damaged is told instead of seen.
    compressor = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True)
    return np.frombuffer(compressor.compress(np.ascontiguousarray(array).reshape(-1).data.cast("B")), np.uint8)


def _decompress(data: UInt8Array, dtype: np.dtype[Any], shape: tuple[int, ...], what: str) -> Any:
    size = dtype.itemsize * int(np.prod(shape, dtype=np.int64))
    try:
        # Checked first: the decompressor allocates memory for any size that the data announce.
        announced = zstandard.get_frame_parameters(data.data).content_size
        if announced != size:
            raise MalformedMessage(f"packed {what} of {shape} take {size} bytes, {announced} were announced")
        opened = zstandard.ZstdDecompressor().decompress(data.data, max_output_size=size, allow_extra_data=False)
    except zstandard.ZstdError as error:
        raise MalformedMessage(f"packed {what} can't be opened: {error}") from error
    if len(opened) != size:
        raise MalformedMessage(f"packed {what} of {shape} take {size} bytes, {len(opened)} came")
    return np.frombuffer(opened, dtype).reshape(shape)
