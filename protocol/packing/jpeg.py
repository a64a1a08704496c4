"""Packs colours as JPEG, with a little loss; needs simplejpeg."""

import numpy as np
import simplejpeg  # pyright: ignore[reportMissingTypeStubs]

from protocol.arrays import UInt8Array
from protocol.errors import MalformedMessage

QUALITY = 95
"""Of 100, with colours at full resolution; the frame's packed depth is as large (docs/decisions/0005)."""

_SUBSAMPLING = "444"
_BASELINE = (0xC0, 0xC1)
_NO_FRAME = (0xC4, 0xC8, 0xCC)
"""Markers in the range of frame headers that are not frame headers."""


def compress_jpeg(rgb: UInt8Array, quality: int = QUALITY) -> UInt8Array:
    """(height, width, 3) to bytes."""
    written = simplejpeg.encode_jpeg(np.ascontiguousarray(rgb), quality, "RGB", _SUBSAMPLING)
    return np.frombuffer(written, np.uint8)


def decompress_jpeg(data: UInt8Array, height: int, width: int) -> UInt8Array:
    """(height, width, 3) from bytes; raises `MalformedMessage` unless they are a complete JPEG of that size."""
    try:
        # Checked first: the decoder allocates memory for any size that the data announce.
        size = simplejpeg.decode_jpeg_header(data)[:2]
        if size != (height, width):
            raise MalformedMessage(f"a JPEG of {size[1]}×{size[0]} pixels came for a picture of {width}×{height}")
        if not _is_baseline(data.tobytes()):
            raise MalformedMessage("a JPEG came that is not a baseline one")
        return simplejpeg.decode_jpeg(data, "RGB")
    except ValueError as error:
        raise MalformedMessage(f"a JPEG can't be decoded: {error}") from error


def _is_baseline(data: bytes) -> bool:
    """Whether the JPEG is baseline: a progressive one, however small, may take any time to decode."""
    place = 2
    while data[place : place + 1] == b"\xff":
        marker = data[place + 1]
        if 0xC0 <= marker <= 0xCF and marker not in _NO_FRAME:
            return marker in _BASELINE
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    return False
