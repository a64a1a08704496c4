"""Images of skin, cloth, hair and eyes, sRGB and opaque, at all their levels. An image's first row is at v = 0.

Whatever varies over an image is computed colour by colour: numpy takes seven times as long along an axis of three.
"""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from protocol.arrays import Float32Array, UInt8Array
from render_worker.arrays import IntArray, RealArray
from render_worker.noise import seamless_noise, shifted
from render_worker.people.outfit import Colour, Fabric, Hair, Outfit

SIZE = 512
"""Of every texture of a person, since OpenGL has them as one array; the masks have it too."""

Levels: TypeAlias = tuple[UInt8Array, ...]
"""An image (SIZE, SIZE, 4) and its mipmaps, each half as wide and as high as the one before, down to one pixel."""

_GRAIN = {"denim": 0.10, "heather": 0.12}
"""How mottled cloth is that is not of one piece."""


class Spot(NamedTuple):
    """Where a mask has anything.

    Attributes:
        places: (p,) in the flat image.
        strength: (p,) above 0, at most 1.
    """

    places: IntArray
    strength: Float32Array


def spots_of(masks: Mapping[str, UInt8Array]) -> dict[str, Spot]:
    """The few places of each mask, (SIZE, SIZE) of 0 to 255."""
    return {name: _spot(mask.ravel()) for name, mask in masks.items()}


def skin_texture(outfit: Outfit, spots: Mapping[str, Spot]) -> Levels:
    """Skin with lips, ears, nails and brows, and the shade of a beard or of cropped hair."""
    tone = np.array(outfit.skin, np.float32)
    planes = _bare_skin(tone, np.random.default_rng(outfit.seed))
    _paint(planes, tone * (0.88, 0.58, 0.58), spots["lips"], 0.75)
    _paint(planes, tone * (1.0, 0.86, 0.83), spots["ears"], 0.5)
    _paint(planes, np.minimum(tone * 1.1 + 12, 255), spots["nails"], 0.6)
    if outfit.stubble > 0:
        _paint(planes, tone * (0.45, 0.45, 0.48), spots["stubble"], outfit.stubble)
    if outfit.hair is not None:
        _paint(planes, np.array(outfit.hair.colour, np.float32), spots["scalp"], 0.9)
    _paint(planes, np.array(outfit.brows, np.float32), spots["brows"], 0.85)
    return _image_of(planes)


def fabric_texture(fabric: Fabric) -> Levels:
    """Seamless cloth."""
    random = np.random.default_rng(fabric.seed)
    base, accent = np.array(fabric.colour, np.float32), np.array(fabric.accent, np.float32)
    pattern = _pattern(fabric, random)
    colours = base if pattern is None else [one + more * pattern for one, more in zip(base, accent - base, strict=True)]
    shade = _cloth_shade(fabric, random)
    return _image_of(colour * shade for colour in colours)


def hair_texture(hair: Hair) -> Levels:
    """Strands along v."""
    random = np.random.default_rng(hair.seed)
    shade = _layer(0.22, 0.7, 0.12, 31, random)
    shade += 1
    return _image_of(colour * shade for colour in np.array(hair.colour, np.float32))


@lru_cache(maxsize=16)
def eye_texture(iris: Colour) -> Levels:
    """An eyeball seen from the front, its pupil in the middle; half the width is its radius."""
    offset = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    radius = np.hypot(offset[:, None], offset[None])
    image = _plain((228, 224, 220))
    image[radius < 0.46, :3] = np.array(iris, np.float32) * 0.6
    image[radius < 0.41, :3] = iris
    image[radius < 0.19, :3] = (12, 11, 12)
    return _levels(image)


@lru_cache(maxsize=16)
def plain_texture(colour: Colour) -> Levels:
    """One colour."""
    return _levels(_plain(colour))


def _plain(colour: Colour) -> UInt8Array:
    return np.full((SIZE, SIZE, 4), (*colour, 255), np.uint8)


def _spot(mask: UInt8Array) -> Spot:
    places = np.flatnonzero(mask)
    return Spot(places, mask[places].astype(np.float32) / np.float32(255))


def _layer(strength: float, roughness: float, stretch: float, seed: int, random: np.random.Generator) -> Float32Array:
    """(SIZE, SIZE) noise of a strength, seen from anywhere."""
    noise = shifted(seamless_noise(SIZE, roughness, stretch, seed), random)
    noise *= np.float32(strength)
    return noise


def _bare_skin(tone: Float32Array, random: np.random.Generator) -> list[Float32Array]:
    """Its planes, with blotches and pores."""
    grain = _layer(0.020, 1.3, 1.0, 11, random)
    grain += _layer(0.012, 0.3, 1.0, 12, random)
    red = grain * np.float32(0.8)
    red += 1
    grain += 1
    return [colour * shade for colour, shade in zip(tone, (red, grain, grain), strict=True)]


def _cloth_shade(fabric: Fabric, random: np.random.Generator) -> Float32Array:
    """(SIZE, SIZE) factor on a cloth's colours: its folds and its weave."""
    shade = _layer(0.055, 1.7, 2.2, 21, random)
    shade += 1
    shade += _layer(0.03, 0.2, 1.0, 22, random)
    if (grain := _GRAIN.get(fabric.pattern)) is not None:
        shade += _layer(grain, 0.6, 0.5, 23, random)
    return shade


def _pattern(fabric: Fabric, random: np.random.Generator) -> RealArray | None:
    """(SIZE, SIZE) or (SIZE, 1) share of the accent colour; None where there is nothing of it."""
    across = np.arange(SIZE)
    period = int(random.choice([32, 64, 128]))
    band = ((across % period) < period * random.uniform(0.25, 0.5)).astype(np.float32)
    if fabric.pattern == "stripes":
        return band[:, None]
    if fabric.pattern == "checks":
        return 0.5 * (band[:, None] + band[None])
    if fabric.pattern == "dots":
        offset = across % 32 - 15.5
        return (np.hypot(offset[:, None], offset[None]) < random.uniform(4, 9)).astype(np.float32)
    return None


def _paint(planes: Iterable[Float32Array], colour: RealArray, spot: Spot, opacity: float) -> None:
    """Mix a colour into the places of a spot."""
    strength = opacity * spot.strength
    for plane, value in zip(planes, colour, strict=True):
        flat = plane.ravel()
        kept = flat[spot.places]
        flat[spot.places] = kept + (value - kept) * strength


def _image_of(planes: Iterable[RealArray]) -> Levels:
    """The image of its colours, each (SIZE, SIZE), cut off to 0 to 255; one after another, for the memory's sake."""
    cut_off = [np.clip(plane, 0, 255, out=plane).astype(np.uint8) for plane in planes]
    return _levels(cv2.merge([*cut_off, np.full_like(cut_off[0], 255)]).astype(np.uint8, copy=False))


def _levels(image: UInt8Array) -> Levels:
    levels = [image]
    while len(levels[-1]) > 1:
        levels.append(_halved(levels[-1]))
    return tuple(levels)


def _halved(image: UInt8Array) -> UInt8Array:
    """Each pixel the mean of a pair of pairs, both rounded up: to the bit as Mesa's software makes mipmaps."""
    pixels = image.view(np.uint32)[:, :, 0]
    columns = _mean(pixels[:, 0::2], pixels[:, 1::2])
    size = len(image) // 2
    return _mean(columns[0::2], columns[1::2]).view(np.uint8).reshape(size, size, 4)


def _mean(one: NDArray[np.uint32], other: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The mean of each of the four bytes of two numbers, rounded up; no byte touches its neighbour."""
    half_apart = one ^ other
    half_apart >>= np.uint32(1)
    half_apart &= np.uint32(0x7F7F7F7F)
    mean = one | other
    mean -= half_apart
    return mean
