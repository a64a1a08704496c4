"""Pictures of what a perception worker saw: depth, heatmaps, the skeleton. Pure: arrays in, arrays out.

All pictures are (height, width, 3) uint8 RGB.
"""

from collections.abc import Iterable

import cv2
import numpy as np
from msgspec import Struct

from protocol.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from protocol.camera import Camera, project
from protocol.skeleton import LIMBS, Joint

RGB = tuple[int, int, int]

QUALITY_STOPS: tuple[RGB, RGB, RGB] = ((202, 20, 32), (255, 240, 150), (20, 110, 190))
"""Bad, middling, good: red over yellow to blue, which colour-blind people tell apart too."""
LEFT_COLOUR: RGB = (60, 235, 90)
RIGHT_COLOUR: RGB = (240, 80, 235)
MIDDLE_COLOUR: RGB = (235, 235, 235)
TRUTH_COLOUR: RGB = (255, 255, 255)
HIDDEN_COLOUR: RGB = (165, 165, 165)
UNKNOWN_COLOUR: RGB = (70, 70, 76)
OUTLINE: RGB = (20, 20, 24)

ARROW_HEAD = 10.0
"""Length of an arrow's head, in pixels."""

_SUBPIXEL_BITS = 4
_FARTHEST = 10_000
"""Pixels outside a picture beyond which coordinates are clipped."""


class DepthScale(Struct, frozen=True):
    """The distances, in metres, that the first and the last colour stand for.

    Colours go by one over the distance, so that the person in front gets more of them than the wall far behind.
    """

    near: float
    far: float

    def share(self, distance: Float64Array) -> Float64Array:
        """How near distances (…) are: 1 at `near`, 0 at `far`."""
        return (1 / distance - 1 / self.far) / (1 / self.near - 1 / self.far)

    def distance(self, share: Float64Array) -> Float64Array:
        """The distances (…), in metres, of shares from 0 to 1."""
        return 1 / (1 / self.far + share * (1 / self.near - 1 / self.far))


class Window(Struct, frozen=True):
    """A part of a picture, in whole pixels."""

    x: int
    y: int
    width: int
    height: int


def quality_colour(quality: float) -> RGB:
    """The colour of a quality from 0 to 1, along straight lines between `QUALITY_STOPS`."""
    mixed = [np.interp(quality, (0.0, 0.5, 1.0), channel) for channel in zip(*QUALITY_STOPS, strict=True)]
    red, green, blue = (round(float(value)) for value in mixed)
    return red, green, blue


def side_colour(joints: Iterable[Joint]) -> RGB:
    """The colour of a limb by the side of the body that it is on."""
    names = [joint.name for joint in joints]
    if any(name.startswith("LEFT") for name in names):
        return LEFT_COLOUR
    if any(name.startswith("RIGHT") for name in names):
        return RIGHT_COLOUR
    return MIDDLE_COLOUR


def measured(depth: Float32Array) -> BoolArray:
    """Where a depth (height, width), in metres, was measured."""
    return np.isfinite(depth) & (depth > 0)


def depth_scale(depth: Float32Array) -> DepthScale:
    """From the nearest to almost the farthest that a depth picture (height, width) holds, in metres."""
    distances = depth[measured(depth)]
    if distances.size == 0:
        return DepthScale(1.0, 2.0)
    near = float(distances.min())
    return DepthScale(near, max(float(np.percentile(distances, 95)), near + 0.1))


def coloured(values: Float32Array | Float64Array, colour_map: int) -> UInt8Array:
    """Values (…, …) from 0 to 1, clipped, by one of OpenCV's colour maps."""
    levels = np.round(np.clip(np.nan_to_num(values), 0.0, 1.0) * 255).astype(np.uint8)
    return cv2.cvtColor(cv2.applyColorMap(levels, colour_map), cv2.COLOR_BGR2RGB).astype(np.uint8)


def depth_picture(depth: Float32Array, scale: DepthScale) -> UInt8Array:
    """Near is warm, far is cold, and what was not measured is grey."""
    known = measured(depth)
    picture = coloured(scale.share(np.where(known, depth, scale.far).astype(float)), cv2.COLORMAP_TURBO)
    picture[~known] = UNKNOWN_COLOUR
    return picture


def heatmap_picture(rgb: UInt8Array, heatmaps: Float32Array, area: Window | None = None) -> UInt8Array:
    """The highest of the joints' heatmaps (the last map, the background, left out) over a grey picture.

    Args:
        heatmaps: (19, rows, columns).
        area: the part of the picture that they cover; all of it where none is given.
    """
    height, width = rgb.shape[:2]
    area = area or Window(0, 0, width, height)
    highest = np.clip(heatmaps[: len(Joint)].max(axis=0), 0.0, 1.0)
    covered = cv2.resize(highest, (area.width, area.height), interpolation=cv2.INTER_LINEAR).astype(np.float32)
    strength = np.zeros((height, width), np.float32)
    # An area may reach over the picture's edge.
    top, left = max(area.y, 0), max(area.x, 0)
    inside = covered[top - area.y : height - area.y, left - area.x : width - area.x]
    strength[top : top + inside.shape[0], left : left + inside.shape[1]] = inside
    grey = cv2.cvtColor(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB) * 0.55
    share = strength[..., None]
    return np.round(grey * (1 - share) + coloured(strength, cv2.COLORMAP_INFERNO) * share).astype(np.uint8)


def enlarged(picture: UInt8Array, width: int) -> UInt8Array:
    """The picture at another width, its proportions kept."""
    if picture.shape[1] == width:
        return picture
    height = round(picture.shape[0] * width / picture.shape[1])
    method = cv2.INTER_AREA if width < picture.shape[1] else cv2.INTER_CUBIC
    return cv2.resize(picture, (width, height), interpolation=method).astype(np.uint8)


def window_around(pixels: Float64Array, width: int, height: int, margin: float = 0.12) -> Window:
    """The part of a picture around pixels (n, 2), in the proportions of the whole; all of it where there are none.

    Args:
        margin: left around them, as a share of their greatest extent.
    """
    inside = pixels[np.isfinite(pixels).all(axis=1)]
    if len(inside) == 0:
        return Window(0, 0, width, height)
    low, high = inside.min(axis=0), inside.max(axis=0)
    around = 2 * margin * float((high - low).max())
    share = min(1.0, max(float(high[0] - low[0] + around) / width, float(high[1] - low[1] + around) / height, 0.1))
    size = round(width * share), round(height * share)
    x, y = np.clip(np.round((low + high) / 2 - np.array(size) / 2), 0, (width - size[0], height - size[1])).astype(int)
    return Window(int(x), int(y), *size)


def cut(picture: UInt8Array, window: Window) -> UInt8Array:
    """The part of the picture that is in the window."""
    return picture[window.y : window.y + window.height, window.x : window.x + window.width]


def magnified_pixels(pixels: Float64Array, window: Window, width: int) -> Float64Array:
    """Where a picture's pixels (n, 2) are in its `window` made `width` wide; pixels' centres have whole coordinates."""
    return (pixels - (window.x, window.y) + 0.5) * (width / window.width) - 0.5


def skeleton_picture(
    picture: UInt8Array, keypoints: Float64Array, quality: Float64Array, marker: float = 9.0
) -> UInt8Array:
    """The picture with limbs coloured by side and joints by quality.

    Args:
        keypoints: (18, 2) pixels of `picture`, NaN where a joint was not detected.
        quality: (18,) in [0, 1].
        marker: radius of a joint, in pixels.
    """
    drawn = picture.copy()
    found = [bool(np.isfinite(keypoint).all()) for keypoint in keypoints]
    limbs = [limb for limb in LIMBS if found[limb[0]] and found[limb[1]]]
    for colour, thickness in ((None, 5), (1, 3)):
        for start, end in limbs:
            line_colour = OUTLINE if colour is None else side_colour((start, end))
            line(drawn, keypoints[start], keypoints[end], line_colour, thickness)
    for joint in Joint:
        if found[joint]:
            disc(drawn, keypoints[joint], marker + 2, OUTLINE)
            disc(drawn, keypoints[joint], marker, quality_colour(float(quality[joint])))
    return drawn


def truth_picture(picture: UInt8Array, pixels: Float64Array, visible: BoolArray, arm: float = 3.5) -> UInt8Array:
    """The picture with a small cross at each true joint: diagonal and white if it is in sight, else upright and grey.

    Args:
        pixels: (18, 2) of `picture`; NaN for a joint behind the camera.
        arm: half the cross's width, in pixels.
    """
    drawn = picture.copy()
    for pixel, seen in zip(pixels, visible, strict=True):
        if np.isfinite(pixel).all():
            cross(drawn, pixel, visible=bool(seen), arm=arm)
    return drawn


def true_pixels(joints: Float64Array, camera: Camera) -> Float64Array:
    """World joints (18, 3) to pixels (18, 2), NaN behind the camera."""
    projected = project(joints, camera)
    return np.where(projected[:, 2:] > 0, projected[:, :2], np.nan)


def cross(picture: UInt8Array, centre: Float64Array, *, visible: bool, arm: float = 3.5) -> None:
    """Draw the cross of a true joint, with a dark edge, into `picture`."""
    stroke = np.array([arm, arm]) if visible else np.array([arm * np.sqrt(2), 0.0])
    for colour, thickness in ((OUTLINE, 3), (TRUTH_COLOUR if visible else HIDDEN_COLOUR, 1)):
        for half in (stroke, np.array([-stroke[1], stroke[0]])):
            line(picture, centre - half, centre + half, colour, thickness)


def line(picture: UInt8Array, start: Float64Array, end: Float64Array, colour: RGB, thickness: int) -> None:
    """Draw a stroke between two pixels (2,) into `picture`."""
    cv2.line(picture, _fixed(start), _fixed(end), colour, thickness, cv2.LINE_AA, _SUBPIXEL_BITS)


def disc(picture: UInt8Array, centre: Float64Array, radius: float, colour: RGB) -> None:
    """Fill a circle about a pixel (2,) of `picture`."""
    ring(picture, centre, radius, colour, cv2.FILLED)


def ring(picture: UInt8Array, centre: Float64Array, radius: float, colour: RGB, thickness: int) -> None:
    """Draw a circle about a pixel (2,) into `picture`."""
    fixed_radius = round(min(radius, _FARTHEST) * 2**_SUBPIXEL_BITS)
    cv2.circle(picture, _fixed(centre), fixed_radius, colour, thickness, cv2.LINE_AA, _SUBPIXEL_BITS)


def arrow(picture: UInt8Array, tail: Float64Array, tip: Float64Array, colour: RGB, thickness: int) -> None:
    """Draw an arrow between two pixels (2,) into `picture`."""
    along = (tip - tail) * (ARROW_HEAD / max(float(np.linalg.norm(tip - tail)), 1e-9))
    aside = np.array([-along[1], along[0]]) / 2
    line(picture, tail, tip, colour, thickness)
    for side in (aside, -aside):
        line(picture, tip, tip - along + side, colour, thickness)


def _fixed(pixel: Float64Array) -> tuple[int, int]:
    # OpenCV takes coordinates in fixed point; far outside the picture they would overflow.
    x, y = np.round(np.clip(pixel, -_FARTHEST, 2 * _FARTHEST) * 2**_SUBPIXEL_BITS).astype(int)
    return int(x), int(y)
