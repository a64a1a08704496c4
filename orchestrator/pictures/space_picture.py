"""Pictures of a person in space: the joints as estimated beside the true ones, without perspective. Pure.

All places are in the person's frame (`person_in_space`), metres; all pictures are (height, width, 3) uint8 RGB.
"""

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from orchestrator.pictures import picture
from orchestrator.pictures.person_in_space import PersonInSpace
from orchestrator.pictures.picture import RGB
from protocol.arrays import BoolArray, Float64Array, UInt8Array
from protocol.camera import Vector3
from protocol.skeleton import LIMBS, Joint

BACKDROP: RGB = (38, 38, 44)
GRID_COLOUR: RGB = (72, 72, 82)
GROUND_COLOUR: RGB = (140, 140, 146)
TRUE_COLOUR: RGB = (255, 176, 60)
"""Of the true skeleton, which is dashed as well, so that the colour is not needed to recognise it."""
CAMERA_COLOUR: RGB = (255, 255, 255)

GRID = 0.5
"""Metres."""
ROOM = 0.25
"""Metres left around a person."""
SMALLEST_EXTENT = 1.5
"""Metres that are shown at least each way."""
BODY_REACH = 1.5
"""Metres from a person's middle; joints farther off do not make the others small."""
NO_PERSON = np.array([[0.0, 0.0, 1.0]])
"""The middle of the picture without a located joint."""

MARKER, TRUE_MARKER = 6.0, 2.5
"""Radius of an estimated and a true joint, in pixels."""
DASH, PAUSE = 7.0, 5.0
"""Pixels of a dashed line that are drawn and left out."""
ARROW = 64.0
"""Length, in pixels."""
ARROW_MARGIN = 0.94
"""How near to the edge an arrow begins, as a share of the way there from the middle."""


class View(Struct, frozen=True):
    """A direction of view.

    Attributes:
        caption: that, in words.
        right, down: what goes to the right and down in the picture, in the person's frame.
    """

    caption: str
    right: Vector3
    down: Vector3


FRONT = View("From the front", (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
LEFT = View("From their left (their front is to the left)", (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
ABOVE = View("From above (their front is down)", (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
VIEWS = (FRONT, LEFT, ABOVE)
"""As an engineer's drawing has them: the side that is next to another view is that view's."""


class Volume(Struct, frozen=True):
    """The part of space that pictures of one size show, from wherever they are taken.

    Attributes:
        centre: what is in the middle of each picture, in the person's frame.
        scale: pixels to a metre.
        width, height: of the pictures, in pixels.
    """

    centre: Vector3
    scale: float
    width: int
    height: int

    def pixels(self, points: Float64Array, view: View) -> Float64Array:
        """Where points (n, 3) of the person's frame are in a picture: (n, 2)."""
        axes = np.array([view.right, view.down])
        return (points - self.centre) @ axes.T * self.scale + self.middle

    def shows(self, points: Float64Array) -> BoolArray:
        """(n,) which points (n, 3) of the person's frame lie within the pictures of all views; NaN does not."""
        highest = (self.width - 1, self.height - 1)
        pixels = np.stack([self.pixels(points, view) for view in VIEWS])
        return np.asarray(((pixels >= 0) & (pixels <= highest)).all(axis=(0, 2)))

    @property
    def middle(self) -> Float64Array:
        """(2,) pixels."""
        return np.array([(self.width - 1) / 2, (self.height - 1) / 2])


def volume_around(points: Float64Array, width: int, height: int) -> Volume:
    """What shows points (n, 3) of a person's frame in pictures of a size, but those that no body reaches.

    NaN rows do not count.
    """
    located = points[np.isfinite(points).all(axis=1)]
    if len(located) == 0:
        located = NO_PERSON
    off = np.abs(located - np.median(located, axis=0)).max(axis=1)
    near = located[off <= max(BODY_REACH, float(off.min()))]
    low, high = near.min(axis=0), near.max(axis=0)
    forth, across, up = np.maximum(high - low + 2 * ROOM, SMALLEST_EXTENT).tolist()
    x, y, z = ((low + high) / 2).tolist()
    return Volume((x, y, z), min(width / max(forth, across), height / max(forth, up)), width, height)


def space_picture(view: View, volume: Volume, person: PersonInSpace) -> UInt8Array:
    """Estimated joints with their radii over a grid, the true skeleton dashed; from above, where the camera looks."""
    drawn = grid_picture(view, volume)
    if view is ABOVE:
        _draw_camera(drawn, volume, volume.pixels(person.camera, view))
    pixels = volume.pixels(person.points, view)
    if person.radius is not None:
        _draw_radii(drawn, pixels, person.radius * volume.scale)
    for start, end in _limbs(pixels):
        picture.line(drawn, pixels[start], pixels[end], picture.side_colour((start, end)), 3)
    if person.truth is not None:
        _draw_truth(drawn, volume.pixels(person.truth, view))
    for joint in farthest_first(person.points, view):
        colour = picture.side_colour((joint,))
        _draw_joint(drawn, pixels[joint], colour, hollow=bool(person.inferred[joint]))
    return drawn


def grid_picture(view: View, volume: Volume) -> UInt8Array:
    """Lines `GRID` apart; the ground is a brighter one."""
    drawn = np.full((volume.height, volume.width, 3), BACKDROP, np.uint8)
    for axis, size, column in ((view.right, volume.width, 0), (view.down, volume.height, 1)):
        middle, reach = float(np.dot(axis, volume.centre)), size / 2 / volume.scale
        for step in range(math.ceil((middle - reach) / GRID), math.floor((middle + reach) / GRID) + 1):
            ends = np.zeros((2, 2))
            ends[:, column] = (step * GRID - middle) * volume.scale + volume.middle[column]
            ends[1, 1 - column] = max(volume.width, volume.height)
            ground = step == 0 and axis[2] != 0
            picture.line(drawn, ends[0], ends[1], GROUND_COLOUR if ground else GRID_COLOUR, 2 if ground else 1)
    return drawn


def space_legend(*, radii: bool, truth: bool) -> list[tuple[str, UInt8Array]]:
    """What is drawn, in words, each with a small picture (18, 40, 3) of it."""
    entries = [("joint in space, seen", _joint_swatch(False)), ("joint in space, inferred", _joint_swatch(True))]
    if radii:
        entries.append(("holds the joint with probability 0.9", _radius_swatch()))
    if truth:
        entries.append(("true skeleton in space", _truth_swatch()))
    return [*entries, ("where the camera looks, from above", _camera_swatch())]


def farthest_first(points: Float64Array, view: View) -> list[Joint]:
    """The joints that are located among (18, 3) points of the person's frame, the one nearest to the viewer last."""
    away = np.cross(view.right, view.down)
    return sorted(_located(points), key=lambda joint: -float(points[joint] @ away))


def dashes(start: Float64Array, end: Float64Array) -> Iterator[tuple[Float64Array, Float64Array]]:
    """The ends (2,) of what is drawn of a dashed line between two pixels."""
    length = float(np.linalg.norm(end - start))
    for begin in np.arange(0.0, length, DASH + PAUSE).tolist():
        stop = min(begin + DASH, length)
        yield start + (end - start) * (begin / length), start + (end - start) * (stop / length)


def _located(points: Float64Array) -> list[Joint]:
    return [joint for joint in Joint if np.isfinite(points[joint]).all()]


def _limbs(pixels: Float64Array) -> list[tuple[Joint, Joint]]:
    located = _located(pixels)
    return [(start, end) for start, end in LIMBS if start in located and end in located]


def _draw_radii(drawn: UInt8Array, pixels: Float64Array, radii: Float64Array) -> None:
    for joint in _located(pixels):
        if np.isfinite(radii[joint]):
            picture.ring(drawn, pixels[joint], float(radii[joint]), _dimmed(picture.side_colour((joint,))), 1)


def _dimmed(colour: RGB) -> RGB:
    red, green, blue = ((3 * channel + 2 * behind) // 5 for channel, behind in zip(colour, BACKDROP, strict=True))
    return red, green, blue


def _draw_truth(drawn: UInt8Array, pixels: Float64Array) -> None:
    for start, end in _limbs(pixels):
        for begin, stop in dashes(pixels[start], pixels[end]):
            picture.line(drawn, begin, stop, TRUE_COLOUR, 2)
    for joint in _located(pixels):
        picture.disc(drawn, pixels[joint], TRUE_MARKER, TRUE_COLOUR)


def _draw_joint(drawn: UInt8Array, pixel: Float64Array, colour: RGB, *, hollow: bool) -> None:
    picture.disc(drawn, pixel, MARKER + 1.5, BACKDROP)
    if hollow:
        picture.ring(drawn, pixel, MARKER - 0.5, colour, 2)
    else:
        picture.disc(drawn, pixel, MARKER, colour)


def _draw_camera(drawn: UInt8Array, volume: Volume, pixels: Float64Array) -> None:
    """The arrow begins at the camera, or at the picture's edge before a camera farther away.

    Args:
        pixels: (2, 2) the camera's, and those of the point that it looks at.
    """
    away, ahead = pixels[0] - volume.middle, pixels[1] - pixels[0]
    inside = float((ARROW_MARGIN * volume.middle / np.maximum(np.abs(away), 1e-9)).min())
    tail = volume.middle + away * min(inside, 1.0)
    picture.arrow(drawn, tail, tail + ARROW * ahead / np.linalg.norm(ahead), CAMERA_COLOUR, 2)


def _swatch() -> UInt8Array:
    return np.full((18, 40, 3), BACKDROP, np.uint8)


def _joint_swatch(hollow: bool) -> UInt8Array:
    swatch = _swatch()
    picture.line(swatch, np.array([4.0, 8.5]), np.array([35.0, 8.5]), picture.MIDDLE_COLOUR, 3)
    _draw_joint(swatch, np.array([19.5, 8.5]), picture.MIDDLE_COLOUR, hollow=hollow)
    return swatch


def _radius_swatch() -> UInt8Array:
    swatch = _swatch()
    picture.ring(swatch, np.array([19.5, 8.5]), 7.0, _dimmed(picture.MIDDLE_COLOUR), 1)
    return swatch


def _truth_swatch() -> UInt8Array:
    swatch = _swatch()
    for begin, stop in dashes(np.array([4.0, 8.5]), np.array([35.0, 8.5])):
        picture.line(swatch, begin, stop, TRUE_COLOUR, 2)
    return swatch


def _camera_swatch() -> UInt8Array:
    swatch = _swatch()
    picture.arrow(swatch, np.array([5.0, 8.5]), np.array([34.0, 8.5]), CAMERA_COLOUR, 2)
    return swatch
