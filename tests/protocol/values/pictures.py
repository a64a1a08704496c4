"""Pictures to pack: smooth ones as a camera's, and any bytes at all."""

import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import Frame

POSE = CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0))
LITTLE = 300_000
"""Bytes: less than half of what a picture of 640×480 takes."""

sizes = st.tuples(st.integers(1, 9), st.integers(1, 9))
colours = sizes.flatmap(lambda size: nps.arrays(np.uint8, (*size, 3)))
# Any 32 bits: NaN with any payload, infinities, both zeros.
depths = sizes.flatmap(lambda size: nps.arrays(np.uint32, size, elements=st.integers(0, 2**32 - 1))).map(
    lambda bits: bits.view(np.float32)
)


def camera_of(height: int, width: int) -> Camera:
    return Camera(POSE, Intrinsics.from_horizontal_fov(width, height, 70.0))


def smooth_frame(height: int = 48, width: int = 64) -> Frame:
    """A frame as a camera could see it, so that packing makes it smaller."""
    rows, columns = np.mgrid[:height, :width]
    rgb = np.stack((rows * 2, columns, rows + columns), axis=-1) % 256
    depth = (2 + rows / height).astype(np.float32)
    depth[:2] = np.nan
    return Frame(rgb=rgb.astype(np.uint8), depth=depth, camera=camera_of(height, width), timings={"render": 0.5})


@contextmanager
def allocating_little() -> Iterator[None]:
    """Fails where Python's memory grows by half a picture or more meanwhile, even if it is given back."""
    tracemalloc.start()
    try:
        yield
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < LITTLE, f"{peak} bytes were allocated"
