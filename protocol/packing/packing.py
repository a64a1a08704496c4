"""Frames packed for their way between machines, and opened again.

Only render and perception workers import this, and need its libraries (zstandard, simplejpeg): `Frame` itself knows
what a packed one looks like. What is packed and opened in a handler holds up no ping, and counts as the handler's time.
"""

import numpy as np
from msgspec.structs import replace

from protocol.frame import Encoding, Frame, Packed
from protocol.limits import DEFAULT_LIMITS, Limits, require_picture_travels
from protocol.packing.jpeg import compress_jpeg, decompress_jpeg
from protocol.packing.lossless import compress_colours, compress_depth, decompress_colours, decompress_depth


def pack(frame: Frame, encoding: Encoding, limits: Limits = DEFAULT_LIMITS) -> Frame:
    """The frame as it is to travel; the same one for `none`.

    Raises:
        LimitExceeded: it is larger than what `unpack` opens.
    """
    if encoding == "none":
        return frame
    _require_travels(frame, limits)
    colours = compress_jpeg(frame.rgb) if encoding == "jpeg" else compress_colours(frame.rgb)
    packed = Packed(encoding=encoding, rgb=colours, depth=compress_depth(frame.depth))
    return replace(frame, rgb=np.zeros((0, 0, 3), np.uint8), depth=np.zeros((0, 0), np.float32), packed=packed)


def unpack(frame: Frame, limits: Limits = DEFAULT_LIMITS) -> Frame:
    """The frame with its arrays, which are read-only; the same one where it is not packed.

    Raises:
        LimitExceeded: its arrays are larger than those that may travel.
        MalformedMessage: what is packed is no picture of the frame's size.
    """
    packed = frame.packed
    if packed is None:
        return frame
    _require_travels(frame, limits)
    size = frame.area.shape
    rgb = (decompress_jpeg if packed.encoding == "jpeg" else decompress_colours)(packed.rgb, *size)
    depth = decompress_depth(packed.depth, *size)
    rgb.flags.writeable = depth.flags.writeable = False
    return replace(frame, rgb=rgb, depth=depth, packed=None)


def _require_travels(frame: Frame, limits: Limits) -> None:
    """What is not taken as it is, is not taken packed: a few bytes may announce any size."""
    require_picture_travels(frame.area.width, frame.area.height, limits)
