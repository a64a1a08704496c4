"""The evidence of a frame as a lifter's network takes it: one token for each joint, and the frame that it is told in.

Lengths are in metres, as seen from the camera: x to the right, y down, z along the view, from a point in the body's
middle. Where the camera stands in the world is in no token; what is up is, since people stand on their feet. Seen in a
mirror, left and right joints change places and x its sign: nothing else does.

One frame or a hundred thousand are told by the same code, so what is learned from is what is lifted.
"""

import numpy as np
from msgspec import Struct

from perception_worker.lifter.evidence import LEAST, SHARE, front_depths, median_of_known
from protocol.arrays import BoolArray, Float32Array, Float64Array
from protocol.skeleton import Joint

TOKEN_SIZE = 26

INPUTS: dict[str, tuple[int, ...]] = {
    "rays": (0, 1, 21, 22),
    "narrow window": (*range(2, 9), 18),
    "wide window": tuple(range(9, 16)),
    "height": (16,),
    "found": (17,),
    "distance": (19, 20, 25),
    "up": (23, 24),
}
"""The columns of each thing that is told; for whoever wants to know what it is worth."""

_X, _CENTRE_X = 0, 21
"""Columns whose sign a mirror changes."""

_FARTHEST_ASIDE = 2.0
"""Metres beyond which depths around a joint are of something else, however far."""

_STANDING = 1.35
"""Metres from the lowest to the highest joint of most people; tells how far somebody is who has no depth at all."""

_LEAST_DEPTH, _MOST_DEPTH = 0.5, 15.0

_USUAL_RESOLUTION = 100.0
"""Pixels a metre; resolutions are told as the logarithm of their ratio to it."""


def _mirrored_joints() -> list[int]:
    opposite = {"LEFT": "RIGHT", "RIGHT": "LEFT"}
    names = [joint.name.split("_", 1) for joint in Joint]
    return [Joint["_".join([opposite.get(name[0], name[0]), *name[1:]])] for name in names]


MIRRORED = np.array(_mirrored_joints(), dtype=np.intp)
"""(18,) for each joint, that on the body's other side; its own place for those in the middle."""


class Seen(Struct, frozen=True, eq=False, kw_only=True):
    """What is known of n frames.

    Attributes:
        rays: (n, 18, 2) slopes x/z and y/z to each keypoint, NaN where there is none.
        height: (n, 18) of the joints' peaks, 0 to 1.
        narrow, wide: (n, 18, 7) evidence.
        up: (n, 2) the y and z of what is up, as the camera sees it.
        focal: (n,) pixels per unit of slope.
    """

    rays: Float64Array
    height: Float64Array
    narrow: Float32Array
    wide: Float32Array
    up: Float64Array
    focal: Float64Array


class Tokens(Struct, frozen=True, eq=False, kw_only=True):
    """What a network is told of n frames, and what makes points of its answer.

    Attributes:
        values: (n, 18, TOKEN_SIZE).
        rays: (n, 18, 2) along which each joint is looked for: its keypoint's, or the body's middle.
        depth: (n,) metres along the view to the body's middle.
        measured: (n,) whether any depth told so.
    """

    values: Float32Array
    rays: Float64Array
    depth: Float64Array
    measured: BoolArray


def tokens_of(seen: Seen) -> Tokens:
    """Tell the evidence of frames in each of which a joint at least was found."""
    found = np.isfinite(seen.rays[:, :, 0])
    centre = median_of_known(seen.rays)
    depth = median_of_known(front_depths(seen.narrow))
    measured = np.isfinite(depth)
    depth = np.clip(np.where(measured, depth, _depth_by_size(seen.rays)), _LEAST_DEPTH, _MOST_DEPTH)
    values = np.empty((*found.shape, TOKEN_SIZE), np.float32)
    rays = np.where(found[:, :, None], seen.rays, centre[:, None])
    values[:, :, _X : _X + 2] = (rays - centre[:, None]) * depth[:, None, None]
    values[:, :, 2:9] = _told(seen.narrow, depth)
    values[:, :, 9:16] = _told(seen.wide, depth)
    values[:, :, 16], values[:, :, 17] = seen.height, found
    values[:, :, 18] = np.isfinite(seen.narrow[:, :, LEAST])
    shared = (
        depth / 5.0,
        measured,
        centre[:, 0],
        centre[:, 1],
        seen.up[:, 0],
        seen.up[:, 1],
        np.log(seen.focal / depth / _USUAL_RESOLUTION),
    )
    for place, column in zip((19, 20, _CENTRE_X, 22, 23, 24, 25), shared, strict=True):
        values[:, :, place] = column[:, None]
    return Tokens(values=values, rays=rays, depth=depth, measured=measured)


def mirrored(values: Float32Array) -> Float32Array:
    """(n, 18, TOKEN_SIZE) the same frames as a mirror shows them."""
    seen = values[:, MIRRORED]
    seen[:, :, (_X, _CENTRE_X)] *= -1.0
    return seen


def points_of(tokens: Tokens, offsets: Float64Array) -> Float64Array:
    """(n, 18, 3) points in the cameras' frames, metres.

    Args:
        offsets: (n, 18, 3) a network's answer: x and y across the ray, and how much farther along the view than the
            body's middle.
    """
    along = tokens.depth[:, None] + offsets[:, :, 2]
    across = tokens.rays * along[:, :, None] + offsets[:, :, :2]
    return np.concatenate([across, along[:, :, None]], axis=2)


def _told(evidence: Float32Array, depth: Float64Array) -> Float32Array:
    """(n, 18, 7) depths as seen from the body's, 0 where there are none."""
    told = evidence - depth[:, None, None].astype(np.float32)
    told[:, :, SHARE] = evidence[:, :, SHARE]
    np.nan_to_num(told, copy=False)
    return np.clip(told, -_FARTHEST_ASIDE, _FARTHEST_ASIDE, out=told)


def _depth_by_size(rays: Float64Array) -> Float64Array:
    """(n,) how far people are by how large they look; far where too few joints tell."""
    y = rays[:, :, 1]
    size = np.where(np.isfinite(y), y, -np.inf).max(axis=1) - np.where(np.isfinite(y), y, np.inf).min(axis=1)
    return _STANDING / np.maximum(size, _STANDING / _MOST_DEPTH)
