"""A person in the world, as a filter knows them and as a network sees them in any part of a picture."""

import numpy as np
from msgspec.structs import replace

from perception_worker.networks.decoding import decode
from protocol.camera import Camera, CameraPose, Intrinsics, project
from protocol.frame import Frame
from protocol.pose_estimate import FilterState
from protocol.region import Region
from tests.perception_worker.drawn_maps import STANDING, draw

METRES = 0.1
"""Of a cell of a drawn person: 1.62 m from eye to ankle."""


def camera(position=(4.0, 0.0, 1.2), target=(0.0, 0.0, 1.2), size=(640, 480)):
    return Camera(CameraPose(position, target), Intrinsics.from_horizontal_fov(*size, 70.0))


def body(y=0.0, x=0.0):
    """(18, 3) joints of somebody who stands at (x, y) and looks along x."""
    # Somebody who looks along x has the left hand at y > 0, to the right in the picture of who looks at them.
    return np.stack([np.full(18, x), y + METRES * STANDING[:, 0], 1.1 - METRES * STANDING[:, 1]], axis=1)


def knows(joints, *, deviation=0.1):
    """A filter that has seen these joints, and none that is NaN."""
    seen = np.isfinite(joints[:, 0])
    return replace(
        FilterState.initial(),
        mean=np.where(seen[:, None], joints, 0.0),
        variance=np.full((18, 3), deviation**2),
        process_noise=np.zeros(18),
        seen=seen,
    )


def frame_of(taken_by):
    """A picture, 4 m away, in which the colours of a pixel tell its place: whoever is shown a part knows which."""
    height, width = taken_by.intrinsics.height, taken_by.intrinsics.width
    rows, columns = np.mgrid[:height, :width]
    rgb = np.stack([columns % 256, rows % 256, columns // 256 + 16 * (rows // 256)], axis=2).astype(np.uint8)
    return Frame(rgb=rgb, depth=np.full((height, width), 4.0, np.float32), camera=taken_by)


class Onlooker:
    """A network that sees people where they are in the picture, whatever part of it it is shown.

    Attributes:
        shown: the regions that it was shown.
    """

    def __init__(self, input_size, taken_by, *people):
        self.input_size = input_size
        self.shown = []
        self._people = [project(joints, taken_by)[:, :2] for joints in people]

    def infer(self, rgb):
        low_x, low_y, high = (int(value) for value in rgb[0, 0])
        region = Region(low_x + 256 * (high % 16), low_y + 256 * (high // 16), rgb.shape[1], rgb.shape[0])
        self.shown.append(region)
        rows, columns = (side // 8 for side in self.input_size)
        scale = np.array([columns / region.width, rows / region.height])
        return draw(
            [_inside((region.inside(one) + 0.5) * scale - 0.5, rows, columns) for one in self._people],
            size=(rows, columns),
        )

    def decode(self, output):
        return decode(output, 0.1)


def _inside(cells, rows, columns):
    outside = ((cells < -0.5) | (cells > (columns - 0.5, rows - 0.5))).any(axis=1)
    return np.where(outside[:, None], np.nan, cells)
