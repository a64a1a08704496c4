"""Where on the ground the shadow of people can fall, so that shaders look for it nowhere else."""

import math
from collections.abc import Iterable

import numpy as np

from protocol.arrays import Float32Array, Float64Array
from protocol.camera import Intrinsics
from protocol.region import Region
from render_worker.arrays import box_of
from render_worker.opengl.picture import NEAREST
from render_worker.surroundings.light import Light

REACH = 0.006
"""Of the shadow map's width: how far from a place a shader looks for its shadow (0.002, and a texel), and some more."""


def shadowed_ground(casters: Iterable[Float32Array], patch: Float32Array, light: Light) -> Float64Array | None:
    """The part of a patch of the ground that may be in shadow.

    Args:
        casters: of each of the people, (c, 3) corners of their surfaces in the world frame.
        patch: (4, 3) corners of the ground.

    Returns:
        (4, 3) corners of a parallelogram on the ground with all that may be in shadow in it; nothing where the light
        does not tell: the map of shadows does not hold all of the people, or not all of the patch.
    """
    lows, highs = zip(*(box_of(_seen_by_sun(corners, light)[:, :2]) for corners in casters), strict=True)
    low, high = np.min(lows, axis=0) - REACH, np.max(highs, axis=0) + REACH
    if low.min() <= 0 or high.max() >= 1 or _seen_by_sun(patch, light)[:, 2].max() >= 1:
        return None
    x, y = np.array([(low[0], high[0], high[0], low[0]), (low[1], low[1], high[1], high[1])]) * 2 - 1
    return _on_ground(np.stack([x, y], axis=1), light)


def shadowed_region(
    ground: Float64Array | None, view: Float64Array, intrinsics: Intrinsics, region: Region
) -> Region | None:
    """The part of a region that shows some ground, `shadowed_ground`'s; nothing where it shows none of it.

    Args:
        view: (4, 4) world to the clip space of the camera that has the intrinsics.
    """
    if ground is None:
        return region
    x, y, _, distance = view[:, :3] @ ground.T + view[:, 3:]
    if distance.min() <= NEAREST:
        return region
    columns, rows = (x / distance + 1) / 2 * intrinsics.width, (y / distance + 1) / 2 * intrinsics.height
    # A pixel more on each side, whatever the rounding.
    left, right = max(region.left, math.floor(columns.min()) - 1), min(region.right, math.ceil(columns.max()) + 1)
    top, bottom = max(region.top, math.floor(rows.min()) - 1), min(region.bottom, math.ceil(rows.max()) + 1)
    return Region(left, top, right - left, bottom - top) if left < right and top < bottom else None


def _seen_by_sun(corners: Float32Array, light: Light) -> Float64Array:
    """(c, 3) places in the map of shadows, 0 to 1."""
    return (corners @ light.view[:3, :3].T + light.view[:3, 3]) * 0.5 + 0.5


def _on_ground(seen: Float64Array, light: Light) -> Float64Array | None:
    """(n, 3) where the sun's rays through places of its clip space (n, 2) meet the ground; nothing if they don't."""
    back = np.linalg.inv(light.view)
    start = seen @ back[:3, :2].T + back[:3, 3]
    ray = back[:3, 2]
    if abs(ray[2]) < 1e-3 * np.linalg.norm(ray):
        return None
    return start - np.outer(start[:, 2] / ray[2], ray)
