"""The box around a person shows that they are not in a region; OpenGL would have to transform all their corners."""

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.camera import Intrinsics
from protocol.region import Region
from render_worker.arrays import box_of
from render_worker.opengl.picture import NEAREST


class Outline:
    """The box around a person's surfaces.

    Args:
        points: (n, 3) world frame, metres.
    """

    def __init__(self, points: Float32Array) -> None:
        corners = np.stack(np.meshgrid(*zip(*box_of(points), strict=True)), axis=-1).reshape(8, 3)
        self._corners = np.vstack([corners.T, np.ones(8)])

    def may_show(self, clip: Float64Array, intrinsics: Intrinsics, region: Region) -> bool:
        """Whether any of it may be in a region, or less than a pixel beside it.

        Args:
            clip: (4, 4) world to the clip space of the camera that has the intrinsics.
        """
        x, y, _, distance = clip @ self._corners
        # Times the distance, so that they can be compared behind the camera too.
        columns, rows = (x + distance) * (intrinsics.width / 2), (y + distance) * (intrinsics.height / 2)
        outside = (
            columns < (region.left - 1) * distance,
            columns > (region.right + 1) * distance,
            rows < (region.top - 1) * distance,
            rows > (region.bottom + 1) * distance,
            distance < NEAREST,
        )
        return not np.any(np.all(outside, axis=1))

    def nearest(self, clip: Float64Array) -> float:
        """Metres along the view before which there is nothing of it."""
        return float((clip[3] @ self._corners).min())
