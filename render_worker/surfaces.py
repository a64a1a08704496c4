"""The common part of a surface of all bodies, laid out so that a body's own surface is made fast."""

from typing import NamedTuple

import numpy as np

from protocol.arrays import Float32Array
from render_worker.arrays import IndexArray, IntArray


class Surface(NamedTuple):
    """A part of every body, and where it is on the mean body.

    Attributes:
        source: (c,) body vertex of each corner.
        uv: (c, 2) texture coordinates.
        triangles: (t, 3) corners.
        columns: (3, t) the same, first corners first.
        points: (c, 3) on the mean body, one axis after another in memory, since clothes are cut by one at a time.
        along_arm: (c,) as in `Assets`.
    """

    source: IntArray
    uv: Float32Array
    triangles: IndexArray
    columns: IntArray
    points: Float32Array
    along_arm: Float32Array

    @classmethod
    def of(
        cls,
        source: IndexArray,
        uv: Float32Array,
        triangles: IndexArray,
        canonical: Float32Array,
        along_arm: Float32Array,
    ) -> "Surface":
        """A baked part; `canonical` (n, 3) and `along_arm` (n,) are of the body's vertices."""
        return cls(
            source=source.astype(int),
            uv=uv,
            triangles=triangles,
            columns=np.ascontiguousarray(triangles.T, dtype=int),
            points=np.asfortranarray(canonical[source]),
            along_arm=along_arm[source],
        )

    def above(self, height: float) -> "Surface":
        """The triangles that reach above a height on the mean body, in their order, and no corner of others."""
        higher = self.points[:, 2] > height
        reaching = self.triangles[higher[self.triangles].any(axis=1)]
        kept, renumbered = np.unique(reaching, return_inverse=True)
        triangles = renumbered.reshape(reaching.shape).astype(np.int32)
        return Surface(
            source=self.source[kept],
            uv=self.uv[kept],
            triangles=triangles,
            columns=np.ascontiguousarray(triangles.T, dtype=int),
            points=np.asfortranarray(self.points[kept]),
            along_arm=self.along_arm[kept],
        )
