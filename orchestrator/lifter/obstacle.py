"""An obstacle before the person, painted into a frame: a board of one colour, like a counter, a pole or a door."""

import numpy as np
from msgspec.structs import replace

from protocol.arrays import Float64Array
from protocol.camera import project
from protocol.frame import Frame

NEARER = (0.35, 0.9)
"""Its distance, as a share of the person's distance."""

_SMALLEST, _LARGEST = 0.15, 0.7
"""Of the person's height and width in the picture."""


def hide_behind_board(frame: Frame, joints: Float64Array, random: np.random.Generator) -> Frame:
    """The frame with a board that covers a part of the person.

    Args:
        frame: of a whole picture, not packed.
        joints: (18, 3) the person's, world frame, metres.
    """
    seen = project(joints, frame.camera)
    lowest, highest = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    size = np.maximum(highest - lowest, 8.0) * random.uniform(_SMALLEST, _LARGEST, 2)
    if random.random() < 0.5:
        # A pole from the ground, or a counter across all of the person.
        size[random.integers(2)] = np.max(highest - lowest) * 1.3
    middle = lowest + random.random(2) * (highest - lowest)
    height, width = frame.depth.shape
    left, top = np.clip(np.rint(middle - size / 2), 0, (width, height)).astype(int).tolist()
    right, bottom = np.clip(np.rint(middle + size / 2), 0, (width, height)).astype(int).tolist()
    rgb, depth = frame.rgb.copy(), frame.depth.copy()
    shades = random.integers(0, 256, 3) + random.normal(0.0, 6.0, (bottom - top, right - left, 1))
    rgb[top:bottom, left:right] = np.clip(shades, 0, 255).astype(np.uint8)
    tilt = np.linspace(-0.05, 0.05, right - left) * random.normal()
    depth[top:bottom, left:right] = float(np.median(seen[:, 2])) * random.uniform(*NEARER) + tilt
    return replace(frame, rgb=rgb, depth=depth)
