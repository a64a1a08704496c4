"""How near anything in a picture can be, from boxes and planes: what is far casts short occlusion shadows."""

from collections.abc import Iterable

import numpy as np

from protocol.arrays import Float64Array
from protocol.camera import Camera, world_to_camera
from protocol.region import Region
from render_worker.opengl.outline import Outline
from render_worker.opengl.picture import NEAREST, clip_projection
from render_worker.surroundings.surroundings import HALL_HALF_WIDTH, HALL_HEIGHT

_ROUNDING = 0.999
"""Share of its true distance that a depth buffer keeps at least."""


def nearest_surface(people: Iterable[Outline], camera: Camera, *, hall: bool) -> float:
    """Metres along the view; nothing in the camera's picture is nearer."""
    transform, picture = world_to_camera(camera.pose), Region.seen_by(camera.intrinsics)
    clip = clip_projection(camera.intrinsics) @ transform
    shown = [one for one in people if one.may_show(clip, camera.intrinsics, picture)]
    distances = [one.nearest(clip) for one in shown]
    normals, offsets = _planes(hall)
    heights = offsets - normals @ np.array(camera.pose.position)
    if heights.min() <= 0:
        return NEAREST
    # On a plane the inverse of depth is linear in the pixel, so that it is largest in a corner of the picture.
    inverse = (_corner_rays(camera) @ transform[:3, :3]) @ (normals / heights[:, None]).T
    farthest_inverse = max(float(inverse.max()), 1e-9)
    return max(NEAREST, _ROUNDING * min([1 / farthest_inverse, *distances]))


def _planes(hall: bool) -> tuple[Float64Array, Float64Array]:
    """(p, 3) normals away from the scene, and (p,) how far along them the ground, the ceiling and the walls are."""
    ground = [(0.0, 0.0, -1.0, 0.0)]
    walls = [(x, y, 0.0, HALL_HALF_WIDTH) for x, y in ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0))]
    planes = np.array([*ground, *walls, (0.0, 0.0, 1.0, HALL_HEIGHT)] if hall else ground)
    return planes[:, :3], planes[:, 3]


def _corner_rays(camera: Camera) -> Float64Array:
    """(4, 3) of the picture's corners in the camera's frame, of depth 1."""
    intrinsics = camera.intrinsics
    columns = (np.array([-0.5, intrinsics.width - 0.5]) - intrinsics.cx) / intrinsics.fx
    rows = (np.array([-0.5, intrinsics.height - 0.5]) - intrinsics.cy) / intrinsics.fy
    return np.array([(x, y, 1.0) for x in columns for y in rows])
