"""The evidence of a frame as a lifter's network takes it: one token for each joint, and the coordinates it is in.

Lengths are in metres, as seen from the camera: x to the right, y down, z along the view, from a point in the body's
middle. No token tells where the camera stands in the world; tokens do tell the vertical, since people stand on their
feet. In a mirror, left and right joints change places and x its sign: nothing else changes.

The same code makes the tokens for fitting and for lifting, of one frame or of a hundred thousand.
"""

import numpy as np
from msgspec import Struct

from perception_worker.lifter.evidence import LEAST, SHARE, front_depths, median_of_known
from protocol.arrays import AnyArray, BoolArray, Float32Array, Float64Array
from protocol.skeleton import MIRRORED

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
"""The columns of each kind of evidence, for ablations."""

_X, _CENTRE_X = 0, 21
"""Columns whose sign a mirror changes."""

_FARTHEST_ASIDE = 2.0
"""Metres beyond which depths around a joint belong to another surface, however far it is."""

_STANDING = 1.35
"""Metres from the lowest to the highest joint of most people; tells how far a person without any depth is."""

_LEAST_DEPTH, _MOST_DEPTH = 0.5, 15.0

_USUAL_RESOLUTION = 100.0
"""Pixels a metre; a token has the logarithm of a resolution's ratio to it."""


class Seen(Struct, frozen=True, eq=False, kw_only=True):
    """The evidence of n frames.

    Attributes:
        rays: (n, 18, 2) slopes x/z and y/z to each keypoint, NaN where there is none.
        height: (n, 18) of the joints' peaks, 0 to 1.
        narrow, wide: (n, 18, 7) evidence.
        up: (n, 2) the y and z of the upward direction in the camera's frame.
        focal: (n,) pixels per unit of slope.
    """

    rays: Float64Array
    height: Float64Array
    narrow: Float32Array
    wide: Float32Array
    up: Float64Array
    focal: Float64Array


class Tokens(Struct, frozen=True, eq=False, kw_only=True):
    """A network's input for n frames, and what makes points of its answer.

    Attributes:
        values: (n, 18, TOKEN_SIZE).
        rays: (n, 18, 2) on which each joint is expected: its keypoint's, or the body's middle.
        depth: (n,) metres along the view to the body's middle.
        measured: (n,) whether any depth told so.
    """

    values: Float32Array
    rays: Float64Array
    depth: Float64Array
    measured: BoolArray


def tokens_of(seen: Seen) -> Tokens:
    """The tokens of frames in each of which at least one joint was found."""
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
    for place, column in _shared(seen, centre, depth, measured).items():
        values[:, :, place] = column[:, None]
    return Tokens(values=values, rays=rays, depth=depth, measured=measured)


def _shared(seen: Seen, centre: Float64Array, depth: Float64Array, measured: BoolArray) -> dict[int, AnyArray]:
    """The columns (n,) that a frame's joints have in common, by their place in a token."""
    return {
        19: depth / 5.0,
        20: measured,
        _CENTRE_X: centre[:, 0],
        22: centre[:, 1],
        23: seen.up[:, 0],
        24: seen.up[:, 1],
        25: np.log(seen.focal / depth / _USUAL_RESOLUTION),
    }


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
    """(n,) metres to people by their size in the picture; far where too few joints tell."""
    y = rays[:, :, 1]
    size = np.where(np.isfinite(y), y, -np.inf).max(axis=1) - np.where(np.isfinite(y), y, np.inf).min(axis=1)
    return _STANDING / np.maximum(size, _STANDING / _MOST_DEPTH)
