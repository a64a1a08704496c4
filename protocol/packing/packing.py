"""Packs frames for the way between machines, and unpacks them.

Only render and perception workers import this and need its libraries (zstandard, simplejpeg). A handler packs and
unpacks, so pings are not delayed, and the time counts as the handler's.
"""

import numpy as np
from msgspec.structs import replace

from protocol.frame import Encoding, Frame, Packed
from protocol.limits import DEFAULT_LIMITS, Limits, require_picture_travels
from protocol.packing.jpeg import compress_jpeg, decompress_jpeg
from protocol.packing.lossless import compress_colours, compress_depth, decompress_colours, decompress_depth


def pack(frame: Frame, encoding: Encoding, limits: Limits = DEFAULT_LIMITS) -> Frame:
    """The packed frame; the same frame for `none`.

    Raises:
        LimitExceeded: it is larger than `unpack` allows.
    """
    if encoding == "none":
        return frame
    _require_travels(frame, limits)
    colours = compress_jpeg(frame.rgb) if encoding == "jpeg" else compress_colours(frame.rgb)
    packed = Packed(encoding=encoding, rgb=colours, depth=compress_depth(frame.depth))
    return replace(frame, rgb=np.zeros((0, 0, 3), np.uint8), depth=np.zeros((0, 0), np.float32), packed=packed)


def unpack(frame: Frame, limits: Limits = DEFAULT_LIMITS) -> Frame:
    """The frame with its arrays, which are read-only; the same frame if it is not packed.

    Raises:
        LimitExceeded: its arrays are larger than those that may be sent unpacked.
        MalformedMessage: the packed bytes are not a picture of the frame's size.
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
    """A frame that is too large unpacked is refused packed as well: a few bytes may announce any size."""
    require_picture_travels(frame.area.width, frame.area.height, limits)
