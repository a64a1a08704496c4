"""Colours as a JPEG, which are a little off when they are opened again; needs simplejpeg."""

import numpy as np
import simplejpeg  # pyright: ignore[reportMissingTypeStubs]

from protocol.arrays import UInt8Array
from protocol.errors import MalformedMessage

QUALITY = 95
"""Of 100, with colours at the full resolution: the depth beside it is as large (docs/decisions/0005)."""

_SUBSAMPLING = "444"
_BASELINE = (0xC0, 0xC1)
_NO_FRAME = (0xC4, 0xC8, 0xCC)
"""Markers among those that begin a frame which do not."""


def compress_jpeg(rgb: UInt8Array, quality: int = QUALITY) -> UInt8Array:
    """(height, width, 3) to bytes."""
    written = simplejpeg.encode_jpeg(np.ascontiguousarray(rgb), quality, "RGB", _SUBSAMPLING)
    return np.frombuffer(written, np.uint8)


def decompress_jpeg(data: UInt8Array, height: int, width: int) -> UInt8Array:
    """(height, width, 3) from bytes; `MalformedMessage` unless they are a whole JPEG of that size."""
    try:
        # Before anything is made of it: room is made for whatever size the data announce.
        size = simplejpeg.decode_jpeg_header(data)[:2]
        if size != (height, width):
            raise MalformedMessage(f"a JPEG of {size[1]}×{size[0]} pixels came for a picture of {width}×{height}")
        if not _is_baseline(data.tobytes()):
            raise MalformedMessage("a JPEG came that is not a baseline one")
        return simplejpeg.decode_jpeg(data, "RGB")
    except ValueError as error:
        raise MalformedMessage(f"a JPEG can't be opened: {error}") from error


def _is_baseline(data: bytes) -> bool:
    """Whether a picture is told in one go: one of many passes may take any time to open, however small it is."""
    place = 2
    while data[place : place + 1] == b"\xff":
        marker = data[place + 1]
        if 0xC0 <= marker <= 0xCF and marker not in _NO_FRAME:
            return marker in _BASELINE
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    return False
